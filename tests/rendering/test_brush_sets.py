"""Several brushes in one picture: each box is filled with the brush of its row."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.brushes.brush_set import BrushSet
from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering import reference
from brushgs.rendering.backward import BoxGradients, project_backward, rasterize_backward
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.project import ProjectOptions, project, project_by
from brushgs.rendering.rasterize import rasterize
from brushgs.rendering.render import render
from brushgs.rendering.track import track
from brushgs.rendering.underpaint import SIZE, Underpaint
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from tests.differences import assert_same_gradient, central_differences
from tests.kit.for_each import for_each
from tests.rendering.strokes import bristles, random_boxes, set_back, softened
from tests.rendering.test_soft import CAMERA, scene_of

FILTERS = ["mip", "bilinear", "nearest"]
# Of different sizes: a lacy one, a full one, and one of a single column.
BRUSHES = BrushSet(
    (
        bristles(40, 96),
        StrokeTexture.from_coverage(np.linspace(0.6, 1, 17 * 200).reshape(17, 200)),
        StrokeTexture.from_coverage(np.full((9, 1), 0.95)),
    )
)
LOOKS = {
    "hard": {},
    "underpainted": {"underpaint": Underpaint((1.4, 1.8, 2.3)), "streaks": 0.3},
}


def with_brushes(boxes, *, seed=0, count=3):
    brushes = np.random.default_rng([seed, len(boxes)]).integers(0, count, len(boxes)).astype(np.uint8)
    return replace(boxes, brushes=brushes)


def some_boxes(n=150, width=41, height=23, dtype=np.float64):
    return with_brushes(set_back(random_boxes(n, width, height, sizes=(0.3, 40), dtype=dtype), 1.0))


def some_strokes(n=60, dtype=np.float64) -> Gaussians:
    return with_brushes(scene_of(3, n, dtype))


def assert_same(actual: Frame, expected: Frame, rtol=1e-9, atol=1e-11) -> None:
    for name in ("rgb", "alpha", "depth"):
        np.testing.assert_allclose(
            getattr(actual, name), getattr(expected, name), rtol=rtol, atol=atol, err_msg=name
        )


def assert_identical(actual, expected) -> None:
    for name in ("rgb", "alpha", "depth"):
        np.testing.assert_array_equal(getattr(actual, name), getattr(expected, name), err_msg=name)


# The definition


@for_each("look", LOOKS)
@for_each("softness", [None, 0.5])
@for_each("filter", FILTERS)
def test_kernel_agrees_with_the_definition(filter, softness, look):
    boxes = some_boxes()
    boxes = boxes if softness is None else softened(boxes, softness)
    how = {"width": 41, "height": 23, "filter": filter, **LOOKS[look]}
    expected = reference.rasterize(boxes, BRUSHES, **how)
    assert_same(rasterize(boxes, BRUSHES, **how), expected)
    single = rasterize(boxes.astype(np.float32), BRUSHES, **how)
    close = np.abs(single.rgb - expected.rgb).max(axis=2) < 1e-3  # but for pixels on the edge of a box
    assert close.mean() > 0.99
    alone = rasterize(replace(boxes, brushes=None), BRUSHES, **how)
    assert not np.array_equal(alone.rgb, rasterize(boxes, BRUSHES, **how).rgb)


@pytest.mark.parametrize("filter", FILTERS)
def test_each_box_is_filled_as_by_its_brush_alone(filter):
    """Boxes that do not overlap are painted one by one, each with its own stroke image."""
    boxes = some_boxes(12)
    how = {"width": 41, "height": 23, "filter": filter}
    for row in range(len(boxes)):
        one = boxes.take([row])
        texture = BRUSHES.textures[one.brushes[0]]
        assert_identical(
            rasterize(one, BRUSHES, **how), rasterize(replace(one, brushes=None), texture, **how)
        )


@pytest.mark.parametrize("filter", FILTERS)
def test_the_picture_does_not_depend_on_threads(filter):
    boxes = softened(some_boxes(400, 300, 200, np.float32), 0.5)
    how = {"width": 300, "height": 200, "filter": filter, **LOOKS["underpainted"]}
    serial, threaded = (rasterize(boxes, BRUSHES, num_threads=n, **how) for n in (1, 3))
    assert_identical(serial, threaded)


# The size of boxes


def test_options_take_the_fitted_size_of_each_brush_and_underpaint_fits_the_gaussian():
    options = RenderOptions.of(BRUSHES, underpaint=True)
    fitted = [texture.fitted_sigmas for texture in BRUSHES.textures]
    assert len(set(fitted)) == 3
    np.testing.assert_allclose(options.num_sigmas, np.multiply(fitted, 0.88))
    np.testing.assert_allclose(np.multiply(options.num_sigmas, options.underpaint.reach), 3 * SIZE)
    strokes = some_strokes()
    boxes, _ = project_by(strokes, CAMERA, options.projection_of(len(strokes), strokes.brushes))
    plain = project(strokes, CAMERA, num_sigmas=1, lock="anchor", fade=True)
    both = np.intersect1d(boxes.ids, plain.ids, return_indices=True)
    ratio = boxes.half_extents[both[1]] / plain.half_extents[both[2]]
    np.testing.assert_allclose(ratio, np.array(options.num_sigmas)[boxes.brushes[both[1]], None] + [[0, 0]])


def test_a_stroke_keeps_its_brush_along_a_path():
    strokes = some_strokes(40)
    eyes = [(4 * np.sin(turn), -1, -4 * np.cos(turn)) for turn in np.linspace(0, 0.6, 12)]
    cameras = [Camera.look_at(eye, (0, 0, 0), width=60, height=40) for eye in eyes]
    for boxes in track(strokes, cameras):
        assert len(boxes) > 10
        np.testing.assert_array_equal(boxes.brushes, strokes.brushes[boxes.ids])


def test_render_paints_each_stroke_with_its_own_brush():
    strokes = some_strokes(1)
    for brush, texture in enumerate(BRUSHES.textures):
        own = replace(strokes, brushes=np.array([brush], np.uint8))
        assert_identical(render(own, CAMERA, BRUSHES), render(replace(own, brushes=None), CAMERA, texture))


# Gradients


@for_each("look", LOOKS)
@for_each("filter", ["mip", "bilinear"])
def test_gradients_are_differences_of_the_picture(filter, look):
    g = np.random.default_rng(4)
    boxes = with_brushes(set_back(random_boxes(6, 14, 11, sizes=(3, 9), seed=3), 0.3))
    how = {"filter": filter, **LOOKS[look]}
    weights = g.standard_normal((11, 14, 3))

    def loss(changed):
        frame = rasterize(replace(boxes, **changed), BRUSHES, width=14, height=11, **how)
        return float((weights * frame.rgb).sum())

    frame = rasterize(boxes, BRUSHES, width=14, height=11, **how)
    found = rasterize_backward(boxes, BRUSHES, frame, weights, **how)
    for name in ("colors", "opacities"):  # shapes cross the edges of boxes, see tests/autograd/test_gradcheck
        by_differences = central_differences(lambda x, n=name: loss({n: x}), getattr(boxes, name))
        np.testing.assert_allclose(getattr(found, name), by_differences, rtol=1e-5, atol=1e-6)


def coverage_case():
    """Five boxes, three small brushes, and the weights of a loss."""
    g = np.random.default_rng(1)
    boxes = replace(random_boxes(5, 14, 11, sizes=(4, 9), seed=5), brushes=[0, 1, 2, 0, 1])
    coverages = [g.integers(20, 235, shape).astype(np.uint8) for shape in ((4, 6), (3, 9), (5, 1))]
    return boxes, coverages, g.standard_normal((11, 14, 3))


def set_of(coverages):
    return BrushSet(tuple(map(StrokeTexture.from_coverage, coverages)))


@pytest.mark.parametrize("filter", ["bilinear", "nearest"])
def test_gradients_by_the_coverage_of_each_brush(filter):
    """In steps of 8 bits, in which alpha is linear in each texel."""
    boxes, coverages, weights = coverage_case()
    how = {"filter": filter, "min_transmittance": 0.0}

    def loss(arrays):
        return float((weights * rasterize(boxes, set_of(arrays), width=14, height=11, **how).rgb).sum())

    frame = rasterize(boxes, set_of(coverages), width=14, height=11, **how)
    found = rasterize_backward(boxes, set_of(coverages), frame, weights, with_coverage=True, **how)
    for brush, coverage in enumerate(coverages):
        expected = np.zeros(coverage.shape)
        for texel in np.ndindex(coverage.shape):
            ends = []
            for step in (1, -1):
                arrays = [array.copy() for array in coverages]
                arrays[brush][texel] = int(coverage[texel]) + step
                ends.append(loss(arrays))
            expected[texel] = (ends[0] - ends[1]) / (2 / 255)
        assert expected.any()
        np.testing.assert_allclose(found.coverages[brush], expected, rtol=1e-6, atol=1e-9)


def test_gradients_of_project_with_a_size_for_each():
    strokes = some_strokes(5)
    options = ProjectOptions(num_sigmas=np.array([1.0, 1.4, 1.8, 2.2, 2.6]), lock="anchor", fade=True)
    boxes, _ = project_by(strokes, CAMERA, options)
    weights = np.random.default_rng(0).standard_normal(boxes.half_extents.shape)

    def loss(scales):
        changed = project_by(replace(strokes, scales=scales), CAMERA, options)[0]
        return float((weights * changed.half_extents).sum())

    v = BoxGradients(half_extents=weights)
    found = project_backward(strokes, CAMERA, boxes, v, options, columns=["scales"])
    assert_same_gradient("scales", found.scales, central_differences(loss, strokes.scales))


# What is refused


def test_a_row_beyond_the_set_is_refused():
    boxes = with_brushes(random_boxes(9, 20, 20), count=3)
    boxes = replace(boxes, brushes=np.array([0, 1, 2, 0, 3, 0, 1, 2, 9], np.uint8))
    sentence = (
        r"rasterize: brushes must be rows of the brush set, which has 3 brushes, got row 9, first .* at 4"
    )
    with pytest.raises(ValueError, match=sentence):
        rasterize(boxes, BRUSHES, width=20, height=20)
    with pytest.raises(ValueError, match="which has 1 brush, got row 9"):
        rasterize(boxes, BRUSHES.textures[0], width=20, height=20)
    strokes = replace(some_strokes(9), brushes=boxes.brushes)
    with pytest.raises(ValueError, match="project: brushes must be rows of the brush set, which has 3"):
        render(strokes, CAMERA, BRUSHES)


def test_sizes_must_be_one_for_each_stroke():
    strokes = some_strokes(5)
    with pytest.raises(
        ValueError, match="num_sigmas must be one number, or one for each of 5 Gaussians, got 4"
    ):
        project(strokes, CAMERA, num_sigmas=np.ones(4))
    with pytest.raises(ValueError, match=r"num_sigmas must be positive and finite, got 0\.0"):
        project(strokes, CAMERA, num_sigmas=np.array([1.0, 0, 1, 1, 1]))


def test_columns_of_brushes_are_checked_and_carried():
    strokes = some_strokes(6)
    boxes: Boxes = project(strokes, CAMERA)
    np.testing.assert_array_equal(strokes.take([3, 1]).brushes, strokes.brushes[[3, 1]])
    np.testing.assert_array_equal(boxes.take([1]).brushes, boxes.brushes[[1]])
    assert strokes.astype(np.float32).brushes.dtype == boxes.astype(np.float32).brushes.dtype == np.uint8
    assert replace(strokes, brushes=[0, 1, 2, 3, 4, 255]).brushes.dtype == np.uint8
    with pytest.raises(TypeError, match="Gaussians: brushes must be uint8, got float64"):
        replace(strokes, brushes=np.zeros(6))
    with pytest.raises(ValueError, match=r"Gaussians: brushes must have shape \[N=6\], got \[5\]"):
        replace(strokes, brushes=np.zeros(5, np.uint8))
    with pytest.raises(ValueError, match="Gaussians: brushes must lie in 0 to 255, got 0 to 256"):
        replace(strokes, brushes=[0, 0, 0, 0, 0, 256])
