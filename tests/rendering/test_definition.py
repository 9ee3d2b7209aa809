"""`rasterize`: the compiled kernel against the float64 definition, for every stroke, filter and look."""

from dataclasses import replace
from itertools import cycle

import numpy as np
import pytest

from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering import reference
from brushgs.rendering.constants import MIN_ALPHA, MIN_TRANSMITTANCE
from brushgs.rendering.rasterize import RasterOptions, rasterize
from tests.kit.for_each import for_each
from tests.pairs import pairs_of
from tests.rendering.paintings import (
    BRUSHES,
    LOOKS,
    SOLID,
    Painting,
    assert_identical,
    assert_same,
    painting_of,
)
from tests.rendering.strokes import IMAGES, PATHS, boxes_of, bristles, random_boxes, softened, texture_of

# (width, height); a tile is 32 x 16 pixels, a block 4 x 4.
SIZES = [(1, 1), (33, 17), (1, 200), (200, 1), (64, 32), (41, 23)]
ORDERS = "", "soft=0.02", "soft=0.5", "soft=20"
ENDS = "", "cut", "stop=0", "stop=1e-6", "stop=0.02", "stop=0.3"
# Every value of an axis meets every value of the others. Kernels have no order and no streaks.
WORDS = pairs_of(IMAGES, BRUSHES, ORDERS, LOOKS, ENDS)
WORDS += pairs_of(("gaussian", "ellipse"), ("", "raised", "glazed"), ENDS)


@for_each(("words", "size"), zip(WORDS, cycle(SIZES), strict=False))
def test_the_kernel_is_the_definition_in_float64(words, size):
    """Few strokes: with their underpaint no more than 256 wait in soft order, see test_soft.py."""
    painting = painting_of(" ".join(words), 75, *size, sizes=(0.3, 60))
    actual, expected = painting.frame(), painting.defined()
    assert_same(actual, expected)
    assert actual.rgb.dtype == actual.alpha.dtype == np.float64
    assert expected.alpha.any()
    if actual.height is not None:  # which changes no bit of the rest
        assert_identical(replace(actual, height=None), painting.frame(relief=False))


@for_each(
    ("path", "brush", "order", "look", "cut"),
    pairs_of(IMAGES, BRUSHES, ("", "soft=0.5"), LOOKS, ("", "cut"))
    + pairs_of(("gaussian", "ellipse"), ("",), ("",), ("", "raised", "glazed"), ("", "cut")),
)
def test_the_kernel_is_the_definition_in_float32(path, brush, order, look, cut):
    """Rounding, but where it decides about the edge of a texel or a box, or which of two comes first."""
    painting = painting_of(f"{path} {brush} {order} {look} {cut}", 100, 60, 40, dtype=np.float32)
    actual, expected = painting.frame(), painting.defined()
    assert actual.rgb.dtype == actual.alpha.dtype == np.float32
    off = np.abs(actual.rgb - expected.rgb).max(axis=2)
    calm = off <= 2e-4
    assert (~calm).mean() <= 1e-3
    assert off[calm].mean() < 5e-6
    np.testing.assert_allclose(actual.alpha[calm], expected.alpha[calm], atol=2e-4)
    if actual.depth is not None:
        np.testing.assert_allclose(actual.depth[calm], expected.depth[calm], rtol=1e-3, atol=1e-6)
    if actual.height is not None:
        rough = np.abs(actual.height - expected.height)
        assert (rough > 4e-4).mean() <= 2e-3
        assert rough[rough <= 4e-4].mean() < 1e-5
        assert np.ptp(actual.height) > 0.5


def test_what_is_asked_for_makes_a_difference():
    """Else the tests above would show little."""
    plain = painting_of("mip", 75, 41, 23)
    for words in ("soft=0.5", "underpainted", "streaked", "glazed", "cut", "stop=0.3", "tinted", "three"):
        other = painting_of(f"mip {words}", 75, 41, 23)
        assert np.abs(other.frame().rgb - plain.frame().rgb).max() > 1e-3, words
    for words in ("tinted", "three"):
        boxes, brushes, how = painting_of(f"mip {words}", 75, 41, 23)
        alone = Painting(replace(boxes, brushes=None), brushes, how)
        assert not np.array_equal(alone.frame().rgb, rasterize(boxes, brushes, **how).rgb)


@for_each("path", PATHS)
def test_boxes_outside_paint_nothing_and_those_partly_outside_are_cut(path):
    (kind, filter), size = PATHS[path], {"width": 75, "height": 50}
    away = boxes_of([[-50, 20], [200, 20], [30, -80], [30, 4000], [1e9, -1e9]], 10, angles=0.3)
    nothing = rasterize(away, texture_of(kind), filter=filter, **size)
    for plane in (nothing.alpha, nothing.rgb, nothing.depth):
        assert not plane.any()
    across = boxes_of([[-5, 20], [78, 31], [30, -4], [41, 53], [-3, -3]], 14.7, angles=0.7, opacities=0.8)
    painting = Painting(across, texture_of(kind), {"filter": filter, **size})
    assert_same(painting.frame(), painting.defined())
    assert (painting.frame().alpha > 0).sum() > 300


@for_each("look", LOOKS)
@for_each("path", IMAGES)
@for_each("dtype", [np.float32, np.float64])
def test_no_boxes_paint_nothing(path, look, dtype):
    painting = painting_of(f"{path} {look}", 5, 40, 20, dtype=dtype)
    frame = painting._replace(boxes=painting.boxes.take(np.s_[:0])).frame()
    assert (frame.rgb == (look == "glazed")).all()  # a glaze is the light that is left
    for plane in (frame.alpha, frame.depth, frame.height):
        assert plane is None or (plane.dtype == dtype and not plane.any())


@for_each("shape", [(1, 1), (1, 7), (7, 1), (2, 2), (1, 2), (300, 5)])
@for_each("filter", ["bilinear", "mip", "nearest"])
def test_stroke_images_of_any_shape_agree(shape, filter):
    size = {"width": 75, "height": 50, "filter": filter}
    painting = Painting(random_boxes(200, 75, 50), bristles(*shape), size)
    assert_same(painting.frame(), painting.defined())


@pytest.mark.parametrize("is_soft", [False, True])
def test_where_no_stroke_leaves_enough_light_nothing_is_painted(is_soft):
    boxes = boxes_of(np.full((3, 2), 8.0), 30, opacities=0.9, depths=[1.0, 1.1, 1.2])
    boxes = softened(boxes, 1.0) if is_soft else boxes
    brush, how = SOLID if is_soft else texture_of("ellipse"), {"width": 16, "height": 16}
    painting = Painting(boxes, brush, {"min_transmittance": 0.5, **how})
    for frame in (painting.frame(), painting.defined()):
        assert not frame.rgb.any()
        assert not frame.alpha.any()
        assert not frame.depth.any()


def test_a_pile_without_a_stop_takes_all_strokes_of_a_pixel():
    """In float32 a hundred strokes of full paint leave a light of zero, not NaN."""
    boxes = boxes_of(np.full((100, 2), 8.0), 30, dtype=np.float32)
    frame = rasterize(boxes, texture_of("ellipse"), width=16, height=16, min_transmittance=0)
    np.testing.assert_allclose(frame.alpha, 1)
    np.testing.assert_allclose(frame.rgb[..., 0], 1, rtol=1e-6)
    np.testing.assert_allclose(frame.depth, sum(0.99 * (k + 1) * 0.01**k for k in range(9)), rtol=1e-6)


# Float32


THRESHOLDS = [  # coverage, opacities that lie on a threshold but for noise, and the largest error there
    (100, lambda noise: [MIN_ALPHA * 255 / 100 * (1 + noise)], 1 / 255),
    (255, lambda noise: [0.9, 0.95, 1 - MIN_TRANSMITTANCE / 0.005 * (1 + noise)], 0.005),
]


@pytest.mark.parametrize(("coverage", "opacities", "largest"), THRESHOLDS)
def test_float32_takes_either_side_of_a_threshold_only_where_one_is_met(coverage, opacities, largest):
    """Each pixel has strokes of its own, laid on the skip or the stop to 3e-7, then just beside it."""
    y, x = (axis.ravel() + 0.5 for axis in np.mgrid[:20, :40])
    noise = 3e-7 * np.random.default_rng(8).normal(size=len(x))
    texture = StrokeTexture.from_coverage(np.full((2, 2), coverage, np.uint8))
    off = []
    for hair in (0, 3e-6, -3e-6):
        alphas = np.stack([np.broadcast_to(a, noise.shape) for a in opacities(noise + hair)])
        centers = np.tile(np.stack([x, y], axis=1), (len(alphas), 1))
        boxes = boxes_of(centers, 0.45, colors=1, opacities=alphas.ravel())
        size = {"width": 40, "height": 20, "filter": "bilinear"}
        actual = rasterize(boxes.astype(np.float32), texture, **size)
        expected = reference.rasterize(boxes, texture, RasterOptions(**size))
        off.append(np.abs(actual.rgb - expected.rgb).max(axis=2))
    assert (off[0] > 1e-3).sum() > 20
    assert off[0].max() < largest * 1.001
    assert off[1].max() < 1e-6
    assert off[2].max() < 1e-6
