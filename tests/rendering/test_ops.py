"""`rasterize`: the compiled kernel against the float64 definition, for every stroke, filter and shape."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering import reference
from brushgs.rendering.constants import MIN_ALPHA, MIN_TRANSMITTANCE
from brushgs.rendering.rasterize import rasterize
from brushgs.values.boxes import Boxes
from brushgs.values.frame import Frame
from tests.kit.for_each import for_each
from tests.rendering.strokes import PATHS, boxes_of, bristles, random_boxes, texture_of

# (width, height); a tile is 32 x 16 pixels, a block 4 x 4.
SIZES = [(1, 1), (33, 17), (1, 500), (500, 1), (64, 32), (130, 75)]
STEP = 1 / 255  # one step of an 8-bit picture
SOLID = StrokeTexture.from_coverage(np.ones((2, 2)))


def painted(boxes: Boxes, path: str, width: int, height: int, **options) -> tuple[Frame, Frame]:
    """What the kernel paints, and what it should."""
    kind, filter = PATHS[path]
    texture, size = texture_of(kind), {"width": width, "height": height}
    return (
        rasterize(boxes, texture, filter=filter, **size, **options),
        reference.rasterize(boxes, texture, filter=filter, **size),
    )


def assert_same(actual: Frame, expected: Frame) -> None:
    """Equal to rounding of float64. Measured worst over all tests below: 4e-12 relative to 1."""
    for name in ("rgb", "alpha", "depth"):
        np.testing.assert_allclose(
            getattr(actual, name), getattr(expected, name), rtol=1e-10, atol=1e-11, err_msg=name
        )


# Float64


@for_each(("width", "height"), SIZES)
@for_each("path", PATHS)
def test_kernel_agrees_with_the_definition_in_float64(path, width, height):
    boxes = random_boxes(300, width, height, sizes=(0.3, 60))
    actual, expected = painted(boxes, path, width, height)
    assert_same(actual, expected)
    assert expected.alpha.max() > 0.1
    assert actual.rgb.dtype == actual.alpha.dtype == actual.depth.dtype == np.float64


SHAPES = {
    "huge": {"half_extents": [[1e6, 1e6], [1e6, 3.0], [2.5, 1e6]] * 8},
    "sub-pixel": {"half_extents": 0.31},
    "a thousandth of a pixel": {"half_extents": [[1e-3, 1e-3], [1e-3, 30], [30, 1e-3]] * 8},
    "zero extents": {"half_extents": [[0, 0], [0, 9], [9, 0], [5, 5]] * 6},
    "horizontal": {"angles": 0.0},
    "vertical": {"angles": [np.pi / 2, -np.pi / 2] * 12},
    "upside down": {"angles": [np.pi, -np.pi] * 12},
    "many turns": {"angles": np.linspace(-1e4, 1e4, 24)},
    "equal depths": {"depths": 2.0},
    "opacity 0 and 1": {"opacities": [0.0, 1.0, 1.0] * 8},
    "opacity about the skip": {"opacities": np.linspace(0.9, 1.1, 24) * MIN_ALPHA},
    "colours above 1": {"colors": (3.0, 0.0, 1.5)},
}


@for_each("path", PATHS)
def test_boxes_outside_paint_nothing_and_those_partly_outside_are_cut(path):
    away = boxes_of([[-50, 20], [200, 20], [30, -80], [30, 4000], [1e9, -1e9]], 10, angles=0.3)
    actual, expected = painted(away, path, 75, 50)
    assert not actual.alpha.any()
    assert not actual.rgb.any()
    assert not actual.depth.any()
    across = boxes_of([[-5, 20], [78, 31], [30, -4], [41, 53], [-3, -3]], 14.7, angles=0.7, opacities=0.8)
    actual, expected = painted(across, path, 75, 50)
    assert_same(actual, expected)
    assert (actual.alpha > 0).sum() > 300


@for_each("path", PATHS)
@for_each("dtype", [np.float32, np.float64])
def test_no_boxes_paint_nothing(path, dtype):
    boxes = random_boxes(5, 40, 20, dtype=dtype)
    none = boxes.take(np.s_[:0])
    actual, _ = painted(none, path, 40, 20)
    for plane in (actual.rgb, actual.alpha, actual.depth):
        assert plane.dtype == dtype
        assert not plane.any()


@for_each("shape", [(1, 1), (1, 7), (7, 1), (2, 2), (1, 2), (300, 5)])
@for_each("filter", ["bilinear", "mip", "nearest"])
def test_stroke_images_of_any_shape_agree(shape, filter):
    boxes, texture = random_boxes(200, 75, 50), bristles(*shape)
    size = {"width": 75, "height": 50, "filter": filter}
    assert_same(rasterize(boxes, texture, **size), reference.rasterize(boxes, texture, **size))


def test_depth_is_the_alpha_weighted_mean_of_camera_z():
    boxes = boxes_of([[4.5, 4.5]] * 2, 40, depths=[2.0, 5.0], opacities=[0.5, 0.8])
    frame = rasterize(boxes, SOLID, width=9, height=9, filter="bilinear")
    np.testing.assert_allclose(frame.depth, (0.5 * 2 + 0.4 * 5) / 0.9, rtol=1e-14)
    np.testing.assert_allclose(frame.alpha, 0.9, rtol=1e-14)


def test_a_stroke_image_appears_upright_at_angle_zero_and_turns_with_the_angle():
    corner = np.zeros((2, 2))
    corner[0, 1] = 1  # the end of u, the start of v
    where = {}
    for name, angle in {"right, top": 0, "right, bottom": np.pi / 2, "left, bottom": np.pi}.items():
        boxes = boxes_of([[10, 10]], 8, angles=angle)
        alpha = rasterize(
            boxes, StrokeTexture.from_coverage(corner), width=20, height=20, filter="nearest"
        ).alpha
        rows, columns = np.nonzero(alpha)
        where[name] = ("left, " if columns.mean() < 9.5 else "right, ") + (
            "top" if rows.mean() < 9.5 else "bottom"
        )
    assert where == {name: name for name in where}


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_box_paints_the_pixel_centres_inside_it(dtype):
    """About a pixel corner centres lie at +-0.5, +-1.5, ...; of one on the outline rounding decides."""
    for half, sides in {1.6: (4,), 2.0: (4,), 2.4: (4,), 2.5: (4, 5, 6), 2.6: (6,), 3.0: (6,)}.items():
        for quarters in range(4):
            boxes = boxes_of([[8, 8]], half, angles=quarters * np.pi / 2, dtype=dtype)
            frame = rasterize(boxes, SOLID, width=16, height=16, filter="bilinear")
            assert (frame.alpha > 0).any(axis=0).sum() in sides
            assert (frame.alpha > 0).any(axis=1).sum() in sides


# Float32


@pytest.mark.parametrize("seed", [0, 4])
@pytest.mark.parametrize("path", PATHS)
def test_kernel_agrees_with_the_definition_in_float32(path, seed, monkeypatch):
    """Off by rounding, or at a threshold: a box's outline, the edge of a nearest texel, a skip or a stop.

    Measured over 12 seeds: rounding moves a picture by at most 1.2e-4 (bilinear; 8e-6 and less otherwise), in
    the mean by 2e-6; pixels off by more than 1/255 are 7e-6 of all (bilinear, two of 288,000), 4e-5 (nearest)
    or none. With seeds 0 and 4 both kinds occur; each such pixel must be one that thresholds moved by the
    rounding error of float32 decide about.
    """
    boxes = random_boxes(2500, 200, 120, seed=seed, sizes=(0.5, 20), dtype=np.float32)
    actual, expected = painted(boxes, path, 200, 120)
    assert actual.rgb.dtype == actual.alpha.dtype == actual.depth.dtype == np.float32
    off = np.abs(actual.rgb - expected.rgb).max(axis=2)
    assert (off > STEP).mean() <= 1e-4
    rows, columns = np.nonzero(off > 2e-4)
    for row, column in zip(rows, columns, strict=True):
        assert is_at_threshold(monkeypatch, boxes, path, row, column)
    calm = off <= 2e-4
    assert off[calm].mean() < 5e-6
    assert np.abs(actual.alpha - expected.alpha)[calm].mean() < 5e-6
    np.testing.assert_allclose(actual.depth[calm], expected.depth[calm], rtol=1e-3, atol=1e-6)
    assert np.abs(actual.depth[calm] - expected.depth[calm]).mean() < 1e-5


def is_at_threshold(monkeypatch, boxes: Boxes, path: str, row: int, column: int) -> bool:
    """Whether moves of the size of float32's rounding make this pixel of the definition another one."""
    kind, filter = PATHS[path]
    # One pixel of the picture, and the boxes moved so that it is the only one.
    near = np.abs(boxes.centers - (column, row)).max(axis=1) < 2 * boxes.half_extents.max(axis=1) + 2
    boxes = boxes.take(near).astype(np.float64)
    boxes = replace(boxes, centers=boxes.centers - (column, row))

    def pixel(moved: Boxes, **options) -> np.ndarray:
        size = {"width": 1, "height": 1}
        return reference.rasterize(moved, texture_of(kind), filter=filter, **size, **options).rgb[0, 0]

    reach = 1e-6  # of 20 px and of 1: some eight units in the last place
    moved = [pixel(replace(boxes, centers=boxes.centers + 20 * reach * np.array(d))) for d in np.eye(2)]
    moved += [pixel(replace(boxes, centers=boxes.centers - 20 * reach * np.array(d))) for d in np.eye(2)]
    moved += [pixel(replace(boxes, half_extents=boxes.half_extents * (1 + f * reach))) for f in (-1, 1)]
    for factor in (1 - 10 * reach, 1 + 10 * reach):
        moved.append(pixel(boxes, min_transmittance=MIN_TRANSMITTANCE * factor))
        with monkeypatch.context() as patch:
            patch.setattr(reference, "MIN_ALPHA", MIN_ALPHA * factor)
            moved.append(pixel(boxes))
    return bool(np.abs(np.array(moved) - pixel(boxes)).max() > 2e-4)


def opacities_at_the_skip(noise: np.ndarray) -> np.ndarray:
    return MIN_ALPHA * 255 / 100 * (1 + noise)[None]


def opacities_at_the_stop(noise: np.ndarray) -> np.ndarray:
    first, second = 0.9 + 0 * noise, 0.95 + 0 * noise
    return np.stack([first, second, 1 - MIN_TRANSMITTANCE / 0.005 * (1 + noise)])


@pytest.mark.parametrize(
    ("coverage", "opacities", "largest"),
    [(100, opacities_at_the_skip, 1 / 255), (255, opacities_at_the_stop, 0.005)],
)
def test_float32_takes_either_side_of_a_threshold_only_where_one_is_met(coverage, opacities, largest):
    """Each pixel has strokes of its own, laid on the skip or the stop to 3e-7, then just beside it."""
    y, x = (axis.ravel() + 0.5 for axis in np.mgrid[:20, :40])
    noise = 3e-7 * np.random.default_rng(8).normal(size=len(x))
    texture = StrokeTexture.from_coverage(np.full((2, 2), coverage, np.uint8))
    off = []
    for hair in (0, 3e-6, -3e-6):
        alphas = opacities(noise + hair)
        centers = np.tile(np.stack([x, y], axis=1), (len(alphas), 1))
        boxes = boxes_of(centers, 0.45, colors=1, opacities=alphas.ravel())
        size = {"width": 40, "height": 20, "filter": "bilinear"}
        actual = rasterize(in_float32(boxes), texture, **size)
        off.append(np.abs(actual.rgb - reference.rasterize(boxes, texture, **size).rgb).max(axis=2))
    assert (off[0] > 1e-3).sum() > 20
    assert off[0].max() < largest * 1.001
    assert off[1].max() < 1e-6
    assert off[2].max() < 1e-6


def in_float32(boxes: Boxes) -> Boxes:
    return boxes.astype(np.float32)
