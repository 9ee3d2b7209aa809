"""The derivative of rasterising against differences of its definition, and where there is none. No torch."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import brushgs as bg
from brushgs.brushes.levels import level_coverage, level_gradient, unrounded_coverage
from brushgs.rendering import reference
from brushgs.rendering.backward import BOX_COLUMNS, FrameGradients, rasterize_backward
from brushgs.rendering.constants import MAX_ALPHA
from brushgs.rendering.rasterize import RasterOptions, rasterize_traced
from brushgs.rendering.underpaint import Underpaint
from tests.differences import assert_same_gradient, central_differences
from tests.kit.for_each import for_each
from tests.pairs import pairs_of
from tests.rendering.paintings import SOLID, Painting, assert_identical, painting_of
from tests.rendering.strokes import IMAGES, PATHS, boxes_of, bristles, random_boxes, softened, texture_of

SIZE = {"width": 41, "height": 23}  # cut tiles and blocks
SHAPE = (SIZE["height"], SIZE["width"])
MANY = ("bristles", "tinted", "three")
DTYPES = (np.float32, np.float64)
FLAT = bg.StrokeTexture.from_coverage(np.full((2, 2), 255, np.uint8))


def weights(dtype=np.float64, shape=SHAPE):
    g = np.random.default_rng(9)
    v_rgb, v_alpha, v_depth = (g.normal(size=s).astype(dtype) for s in ((*shape, 3), shape, shape))
    return v_rgb, v_alpha, {"depth": v_depth}


def loss_of(frame: bg.Frame, v) -> float:
    return float((frame.rgb * v[0]).sum() + (frame.alpha * v[1]).sum() + (frame.depth * v[2]["depth"]).sum())


def backward(boxes: bg.Boxes, texture, filter="bilinear", v=None, **options):
    frame = bg.rasterize(boxes, texture, filter=filter, **SIZE)
    v = weights(boxes.centers.dtype) if v is None else v
    how = RasterOptions(**SIZE, filter=filter)
    return rasterize_backward(boxes, texture, frame, FrameGradients(*v), how, **options)


ROWS = [*PATHS, *(" ".join(row) for row in pairs_of(IMAGES, ("underpainted", "layered", "streaked"), MANY))]


@pytest.mark.parametrize("words", ROWS)
def test_gradients_are_differences_of_the_definition(words):
    """Twelve boxes over each other and the picture's edge, faint and full ones: some pixels finish.

    In one of three with streaks both bands fade, in others one or none.
    """
    painting = painting_of(words, 12, 33, 18, seed=4, sizes=(2, 14))
    half_extents = painting.boxes.half_extents.copy()
    half_extents[:, 1] = np.geomspace(2, 14, 12) if "streaked" in words else half_extents[:, 1]
    boxes = replace(painting.boxes, opacities=np.linspace(0.2, 1, 12), half_extents=half_extents)
    v, how = weights(shape=(18, 33)), painting.options
    frame = bg.rasterize(boxes, painting.brush, **how)
    actual = rasterize_backward(boxes, painting.brush, frame, FrameGradients(*v), RasterOptions(**how))
    for name in BOX_COLUMNS:

        def loss(values, name=name):
            return loss_of(painting._replace(boxes=replace(boxes, **{name: values})).defined(), v)

        # Closer than usual with streaks: a step of 1e-6 takes a pixel over a texel's edge.
        step = 1e-7 if "streaked" in words else 1e-6
        numerical = central_differences(loss, getattr(boxes, name), step)
        assert_same_gradient(f"{words} {name}", getattr(actual, name), numerical)
        has_none = words in ("nearest", "ellipse") and name in ("centers", "half_extents", "angles")
        assert numerical.any() != has_none


def test_a_stroke_outside_whose_underpaint_reaches_in_has_its_gradient():
    boxes = replace(boxes_of([[-6.0, 8.3]], (5, 3), angles=0.4), setbacks=np.array([1.0]))
    how = {"filter": "bilinear", "underpaint": Underpaint(3.0), "width": 20, "height": 16}
    painting = Painting(boxes, SOLID, how)
    frame = painting.frame()
    assert frame.alpha.any()
    v = FrameGradients(np.ones_like(frame.rgb))
    actual = rasterize_backward(boxes, SOLID, frame, v, RasterOptions(**how))
    for name in ("centers", "half_extents", "angles", "colors", "opacities"):

        def loss(values, name=name):
            return float(painting._replace(boxes=replace(boxes, **{name: values})).defined().rgb.sum())

        numerical = central_differences(loss, getattr(boxes, name))
        assert numerical.any()
        assert_same_gradient(name, getattr(actual, name), numerical)


@for_each("missing", ["alpha", "depth", "alpha and depth"])
def test_a_missing_gradient_is_one_of_zeros(missing):
    boxes, texture = random_boxes(30, **SIZE, seed=2, sizes=(1, 15)), bristles()
    v_rgb, v_alpha, v_layers = weights()
    v_alpha = None if "alpha" in missing else v_alpha
    v_depth = None if "depth" in missing else v_layers["depth"]
    actual = backward(boxes, texture, v=(v_rgb, v_alpha, {"depth": v_depth}))
    zero_alpha, zero_depth = (np.zeros(SHAPE) if v is None else v for v in (v_alpha, v_depth))
    expected = backward(boxes, texture, v=(v_rgb, zero_alpha, {"depth": zero_depth}))
    for name in BOX_COLUMNS:
        np.testing.assert_allclose(getattr(actual, name), getattr(expected, name), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("shape", [(40, 96), (1, 30), (1, 1)])
@pytest.mark.parametrize("filter", ["bilinear", "mip", "nearest"])
def test_the_gradient_by_coverage_is_a_difference_of_the_definition(filter, shape, monkeypatch):
    """Changes of a texel are floats here, on top of the 8 bits that the picture was painted with."""
    g = np.random.default_rng(0)
    coverage = g.integers(60, 200, shape).astype(np.uint8)
    texture, v = bg.StrokeTexture.from_coverage(coverage), weights()
    boxes = random_boxes(6, **SIZE, seed=4, sizes=(2, 14))
    actual = backward(boxes, texture, filter, with_coverage=True).coverage

    def level_of(texels, *level):
        whole = unrounded_coverage(coverage, *level)
        is_within = (whole >= 0) & (whole <= 255)
        return level_coverage(coverage, *level) + is_within * unrounded_coverage(texels - coverage, *level)

    monkeypatch.setattr(reference, "level_coverage", level_of)

    def picture(texels):
        stroke = SimpleNamespace(kind="image", coverage=texels, tint=None)
        return reference.rasterize(boxes, stroke, RasterOptions(filter=filter, **SIZE))

    some = g.permutation(coverage.size)[:40]

    def loss(values):
        texels = coverage.astype(float)
        texels.flat[some] = values
        return loss_of(picture(texels), v)

    painted = bg.rasterize(boxes, texture, filter=filter, **SIZE)
    np.testing.assert_allclose(picture(coverage.astype(float)).rgb, painted.rgb, atol=1e-9)
    numerical = 255 * central_differences(loss, coverage.flat[some].astype(float), step=1e-4)
    assert numerical.any()
    assert_same_gradient(f"{filter} coverage", actual.flat[some], numerical)


@for_each("filter", ["bilinear", "nearest"])
def test_gradients_by_the_coverage_of_each_brush(filter):
    """In steps of 8 bits, in which alpha is linear in each texel."""
    g = np.random.default_rng(1)
    boxes = replace(random_boxes(5, 14, 11, sizes=(4, 9), seed=5), brushes=[0, 1, 2, 0, 1])
    coverages = [g.integers(20, 235, shape).astype(np.uint8) for shape in ((4, 6), (3, 9), (5, 1))]
    v, how = g.normal(size=(11, 14, 3)), {"filter": filter, "min_transmittance": 0, "width": 14, "height": 11}

    def painted(coverages):
        brushes = bg.BrushSet(tuple(map(bg.StrokeTexture.from_coverage, coverages)))
        return brushes, bg.rasterize(boxes, brushes, **how)

    given = *painted(coverages), FrameGradients(v), RasterOptions(**how)
    found = rasterize_backward(boxes, *given, with_coverage=True)
    for brush, coverage in enumerate(coverages):

        def loss(values, brush=brush):
            some = [*coverages[:brush], values.astype(np.uint8), *coverages[brush + 1 :]]
            return float((v * painted(some)[1].rgb).sum())

        expected = 255 * central_differences(loss, coverage.astype(float), step=1)
        assert expected.any()
        np.testing.assert_allclose(found.coverages[brush], expected, rtol=1e-6, atol=1e-9)


def test_a_texel_cut_to_8_bits_passes_nothing_on():
    """The levels of an image with hard edges overshoot; what they cut cannot change a little."""
    coverage = np.where(np.arange(64) < 32, 0, 255).astype(np.uint8)[None].repeat(8, 0)
    texels = unrounded_coverage(coverage, 4, 0)
    is_cut = (texels < 0) | (texels > 255)
    assert is_cut.any()
    assert not is_cut.all()
    np.testing.assert_array_equal(level_gradient(coverage, 4, 0, is_cut.astype(float)), 0)
    assert level_gradient(coverage, 4, 0, (~is_cut).astype(float)).any()


def test_what_is_held_or_hidden_has_no_gradient():
    """Alpha at its bound does not move; a stroke behind two full ones is not seen, a faint one neither."""
    square = {"centers": [[20.3, 11.2]] * 4, "half_extents": 6.0}
    boxes = boxes_of(**square, opacities=[0.003, 1.0, 1.0, 0.5], depths=[1, 2, 3, 4])
    actual = backward(boxes, FLAT)
    for name in BOX_COLUMNS:
        for row in (0, 3):  # under 1/255, and behind what leaves no light
            np.testing.assert_array_equal(getattr(actual, name)[row], 0, err_msg=name)
    np.testing.assert_array_equal(actual.opacities, 0)
    np.testing.assert_array_equal(actual.centers, 0)
    assert actual.colors[1].any()
    # What is left of the light behind the first full stroke.
    np.testing.assert_allclose(actual.colors[2], (1 - MAX_ALPHA) * actual.colors[1], rtol=1e-9)


@for_each("kind", ["image", "gaussian", "ellipse"])
def test_boxes_that_paint_nothing_get_zeros(kind):
    half_extents = [[0, 3], [3, 3], [3, 3], [5, 5]]
    boxes = boxes_of([[5, 5], [-900, 5], [5, 5], [20, 10]], half_extents, opacities=[1, 1, 0, 0.5])
    actual = backward(boxes, texture_of(kind))
    for name in BOX_COLUMNS:
        np.testing.assert_array_equal(getattr(actual, name)[:3], 0, err_msg=name)
    assert actual.colors[3].any()
    nothing = backward(boxes.take(np.s_[:0]), texture_of(kind), with_coverage=kind == "image")
    assert [len(getattr(nothing, name)) for name in BOX_COLUMNS] == [0] * 6
    assert kind != "image" or not nothing.coverage.any()


def test_float32_is_close_to_float64_also_under_many_layers():
    """Forty strokes over each other: the difference that stands for what lies behind has to hold up."""
    g = np.random.default_rng(3)
    columns = {"angles": g.uniform(-3, 3, 40), "colors": g.uniform(0, 1, (40, 3))}
    columns |= {"opacities": g.uniform(0.05, 0.95, 40), "dtype": np.float32}
    boxes = boxes_of(g.uniform(12, 28, (40, 2)) * (1, 0.5), g.uniform(4, 12, (40, 2)), **columns)
    texture = bg.StrokeTexture.open("gaussian")
    single, double = (backward(b, texture) for b in (boxes, boxes.astype(np.float64)))
    for name in BOX_COLUMNS:
        actual, expected = getattr(single, name), getattr(double, name)
        assert actual.dtype == np.float32
        # Measured: 1e-6 to 6e-6 of the norm.
        assert np.linalg.norm(actual - expected) <= 3e-5 * np.linalg.norm(expected), name


def traced(boxes: bg.Boxes, texture, **how):
    options = RasterOptions(**{"filter": "bilinear", "num_threads": 2} | how)
    return rasterize_traced(boxes, bg.BrushSet.of(texture), options)


@for_each(("words", "dtype"), pairs_of([*PATHS, *(f"{path} layered" for path in IMAGES)], DTYPES))
def test_neither_threads_nor_what_painting_kept_change_a_bit(words, dtype):
    """Of strokes that hide others, some behind finished pixels and finished tiles."""
    boxes, texture, how = painting_of(words, 2000, 101, 57, dtype=dtype)
    frame, trace = traced(boxes, texture, **how)
    assert_identical(frame, bg.rasterize(boxes, texture, **how))
    v, has_image = weights(dtype, (57, 101)), "gaussian" not in words and "ellipse" not in words
    results = [
        rasterize_backward(
            *(boxes, texture, frame, FrameGradients(*v), RasterOptions(**how, num_threads=threads)),
            with_coverage=has_image,
            trace=given,
        )
        for given, threads in ((None, 1), (None, 3), (None, 40), (trace, 3))
    ]
    assert results[0].colors.any()
    for result in results[1:]:
        for name in (*BOX_COLUMNS, "coverage"):
            np.testing.assert_array_equal(getattr(result, name), getattr(results[0], name), err_msg=name)


def test_a_trace_of_other_boxes_softness_and_a_kernel_without_an_image_are_refused():
    boxes, brush = random_boxes(5, **SIZE), bristles()
    given = bg.rasterize(boxes, brush, **SIZE), FrameGradients(*weights()), RasterOptions(**SIZE)
    for other, size in ((boxes.take(np.s_[:4]), SIZE), (boxes, {"width": 99, "height": 23})):
        _, trace = traced(other, brush, **size)
        with pytest.raises(ValueError, match="trace must be of painting these boxes"):
            rasterize_backward(boxes, brush, *given, trace=trace)
    with pytest.raises(ValueError, match='boxes must have no softness; project with order="depth"'):
        rasterize_backward(softened(boxes, 0.1), brush, *given)
    with pytest.raises(ValueError, match="rasterize_backward: the built-in kernel 'ellipse' has no coverage"):
        rasterize_backward(boxes, texture_of("ellipse"), *given, with_coverage=True)
