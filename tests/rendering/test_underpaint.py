"""Underpaint: each stroke once more, as a soft kernel behind it."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering import reference
from brushgs.rendering.backward import BOX_COLUMNS, rasterize_backward
from brushgs.rendering.constants import GAUSSIAN_SIGMAS
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.project import ProjectOptions, project, project_by
from brushgs.rendering.rasterize import rasterize
from brushgs.rendering.render import render, render_sequence
from brushgs.rendering.underpaint import OPACITY, SIZE, STROKE_REACH, Underpaint
from brushgs.values.boxes import Boxes
from brushgs.values.frame import Frame
from tests.differences import assert_same_gradient, central_differences
from tests.kit.for_each import for_each
from tests.pairs import pairs_of
from tests.rendering.strokes import PATHS, boxes_of, random_boxes, set_back, softened, texture_of
from tests.rendering.test_soft import CAMERA, scene_of

IMAGES = [path for path, (kind, _) in PATHS.items() if kind == "image"]
KERNELS = [path for path, (kind, _) in PATHS.items() if kind != "image"]
SOLID = StrokeTexture.from_coverage(np.ones((2, 2)))
UNDERPAINT = Underpaint(1.8)
LOOKS = {"": {}, "streaked": {"streaks": 0.3}}


def kernel_of(boxes: Boxes, path: str, width: int, height: int, painter=rasterize, **options) -> Frame:
    kind, filter = PATHS[path]
    how = {"width": width, "height": height, "filter": filter, "underpaint": UNDERPAINT} | options
    return painter(boxes, texture_of(kind), **how)


def painted(boxes: Boxes, path: str, width: int, height: int, **options) -> tuple[Frame, Frame]:
    """What the kernel paints, and what it should."""
    where = boxes, path, width, height
    return kernel_of(*where, **options), kernel_of(*where, reference.rasterize, **options)


def assert_same(actual: Frame, expected: Frame, rtol: float = 1e-9, atol: float = 1e-11) -> None:
    for name in ("rgb", "alpha", "depth"):
        np.testing.assert_allclose(
            getattr(actual, name), getattr(expected, name), rtol=rtol, atol=atol, err_msg=name
        )


def assert_identical(actual: Frame, expected: Frame) -> None:
    for name in ("rgb", "alpha", "depth"):
        np.testing.assert_array_equal(getattr(actual, name), getattr(expected, name), err_msg=name)


# The definition


@for_each(
    ("path", "size", "softness", "look"),
    pairs_of(IMAGES, [(1, 1), (41, 23)], (None, 0.02, 0.5, 20.0), LOOKS),
)
def test_kernel_agrees_with_the_definition_in_float64(path, size, softness, look):
    width, height = size
    num = 150 if softness != 20 else 30  # of which, with their underpaint, no more than 160 wait
    boxes = set_back(random_boxes(num, width, height, sizes=(0.3, 40)), 1.0)
    boxes = boxes if softness is None else softened(boxes, softness)
    actual, expected = painted(boxes, path, width, height, **LOOKS[look])
    assert_same(actual, expected)
    without = kernel_of(boxes, path, width, height, underpaint=None, **LOOKS[look])
    assert np.abs(actual.rgb - without.rgb).max() > 1e-6


@for_each("softness", [None, 0.5])
@for_each("path", IMAGES)
def test_kernel_agrees_with_the_definition_in_float32(path, softness):
    """Rounding, but where it decides about the edge of a texel or a box, or which of two comes first."""
    boxes = set_back(random_boxes(400, 75, 50, seed=4, sizes=(0.5, 20), dtype=np.float32), 1.0)
    boxes = boxes if softness is None else softened(boxes, softness)
    actual, expected = painted(boxes, path, 75, 50)
    assert actual.rgb.dtype == np.float32
    off = np.abs(actual.rgb - expected.rgb).max(axis=2)
    assert (off > 2e-4).mean() <= 1e-3
    calm = off <= 2e-4
    assert off[calm].mean() < 5e-6
    np.testing.assert_allclose(actual.depth[calm], expected.depth[calm], rtol=1e-3, atol=1e-6)


def test_it_is_as_if_soft_kernels_lay_among_the_strokes():
    """The same boxes one by one, stroke or kernel, blended here."""
    boxes = set_back(random_boxes(30, 24, 20, seed=7, sizes=(4, 20)), 2.0)
    frame = rasterize(boxes, SOLID, width=24, height=20, filter="bilinear", underpaint=UNDERPAINT)
    behind = replace(
        boxes,
        half_extents=boxes.half_extents * UNDERPAINT.reach,
        opacities=boxes.opacities * UNDERPAINT.opacity,
        setbacks=None,
    )
    order = sorted((boxes.depths[i] + k * boxes.setbacks[i], k, i) for k in (0, 1) for i in range(30))
    light, rgb = np.ones((20, 24)), np.zeros((20, 24, 3))
    is_open = np.ones((20, 24), bool)
    for _, k, i in order:
        one, texture = (behind, StrokeTexture.open("gaussian")) if k else (boxes, SOLID)
        alpha = rasterize(one.take([i]), texture, width=24, height=20, filter="bilinear").alpha
        is_open &= ~((alpha > 0) & (light * (1 - alpha) < 1e-4 * (1 - 1e-5)))
        alpha = np.where(is_open, alpha, 0)
        rgb += (light * alpha)[..., None] * boxes.colors[i]
        light *= 1 - alpha
    np.testing.assert_allclose(frame.rgb, rgb, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(frame.alpha, 1 - light, rtol=1e-9, atol=1e-12)


def test_underpaint_lies_behind_its_stroke_and_behind_strokes_before_it():
    """Red lies in front of green; its underpaint, by its setback, in front of green or behind."""
    colors = [[1.0, 0, 0], [0, 1, 0]]
    boxes = boxes_of([[10.5, 5.5], [15.5, 5.5]], 5, depths=[1.0, 2.0], colors=colors)
    seen = {}
    for setback in (0.5, 1.0, 1.5):
        some = replace(boxes, setbacks=np.array([setback, 100.0]))
        frame = rasterize(some, SOLID, width=30, height=11, filter="bilinear", underpaint=Underpaint(4.0))
        seen[setback] = frame.rgb[5, 17]  # in the green stroke alone
    assert seen[0.5][0] > 0.5  # in front
    np.testing.assert_array_equal(seen[1.0], seen[1.5])  # ties: strokes first
    assert seen[1.0][0] < 0.01


# Gradients


@for_each("look", LOOKS)
@for_each("path", IMAGES)
def test_gradients_are_differences_of_the_definition(path, look):
    kind, filter = PATHS[path]
    texture, g = texture_of(kind), np.random.default_rng(9)
    size = {"width": 33, "height": 18}  # 3 x 2 tiles
    how = {"filter": filter, "underpaint": UNDERPAINT} | LOOKS[look]
    boxes = set_back(random_boxes(12, **size, seed=4, sizes=(2, 14)), 1.0)
    boxes = replace(boxes, opacities=np.linspace(0.2, 1, 12))
    v_rgb, v_alpha, v_depth = (g.normal(size=s) for s in ((18, 33, 3), (18, 33), (18, 33)))
    frame = rasterize(boxes, texture, **size, **how)
    actual = rasterize_backward(boxes, texture, frame, v_rgb, v_alpha, {"depth": v_depth}, **how)
    for name in BOX_COLUMNS:

        def loss(values, name=name):
            changed = replace(boxes, **{name: values})
            frame = reference.rasterize(changed, texture, **size, **how)
            return float((frame.rgb * v_rgb).sum() + (frame.alpha * v_alpha + frame.depth * v_depth).sum())

        numerical = central_differences(loss, getattr(boxes, name))
        assert numerical.any()
        assert_same_gradient(f"{path} {name}", getattr(actual, name), numerical)


def test_a_stroke_outside_whose_underpaint_reaches_in_has_its_gradient():
    boxes = replace(boxes_of([[-6.0, 8.3]], (5, 3), angles=0.4), setbacks=np.array([1.0]))
    how = {"filter": "bilinear", "underpaint": Underpaint(3.0)}
    frame = rasterize(boxes, SOLID, width=20, height=16, **how)
    assert frame.alpha.any()
    actual = rasterize_backward(boxes, SOLID, frame, np.ones_like(frame.rgb), **how)
    for name in ("centers", "half_extents", "angles", "colors", "opacities"):
        numerical = central_differences(
            lambda values, name=name: float(
                reference.rasterize(
                    replace(boxes, **{name: values}), SOLID, width=20, height=16, **how
                ).rgb.sum()
            ),
            getattr(boxes, name),
        )
        assert numerical.any()
        assert_same_gradient(name, getattr(actual, name), numerical)


# Where it comes from


@for_each("order", ["depth", "soft"])
@for_each("dtype", [np.float32, np.float64])
def test_setbacks_are_the_mean_of_the_two_larger_scales_in_every_view(dtype, order):
    scene = scene_of(2, dtype=dtype)
    boxes = project(scene, CAMERA, order=order, underpaint=True)
    larger = np.sort(scene.scales[boxes.ids].astype(np.float64), axis=1)[:, 1:]
    assert boxes.setbacks.dtype == dtype
    np.testing.assert_allclose(boxes.setbacks, np.sqrt(larger.prod(axis=1)), rtol=1e-6)
    expected = reference.project(scene, CAMERA, order=order, underpaint=True)
    np.testing.assert_allclose(boxes.setbacks, expected.setbacks, rtol=1e-6)
    without = project(scene, CAMERA, order=order)
    assert without.setbacks is None
    for name in ("centers", "half_extents", "depths", "colors", "ids", "softness"):
        np.testing.assert_array_equal(getattr(boxes, name), getattr(without, name))


def test_options_draw_strokes_over_underpaint_smaller_and_underpaint_by_the_gaussian():
    texture = StrokeTexture.open("flat")
    plain, over = RenderOptions.of(texture), RenderOptions.of(texture, underpaint=True)
    assert plain.underpaint is None
    assert over.num_sigmas == pytest.approx(STROKE_REACH * plain.num_sigmas)
    assert over.underpaint.reach * over.num_sigmas == pytest.approx(SIZE * GAUSSIAN_SIGMAS)
    assert over.underpaint.opacity == OPACITY
    given = RenderOptions.of(texture, underpaint=Underpaint(2.0, 0.5), num_sigmas=1.5)
    assert (given.num_sigmas, given.underpaint) == (1.5, Underpaint(2.0, 0.5))
    for off in (False, None):
        assert RenderOptions.of(texture, underpaint=off) == plain
    kernel = StrokeTexture.open("gaussian")
    assert RenderOptions.of(kernel, underpaint=True, streaks=0.2) == RenderOptions.of(kernel)


def test_render_is_the_steps_and_a_sequence_takes_it_to_every_frame():
    scene, texture = scene_of(3), texture_of("image")
    how = RenderOptions.of(texture, underpaint=True, streaks=0.3)
    boxes, _ = project_by(scene, CAMERA, how.projection_of(len(scene)))
    steps = rasterize(boxes, texture, height=40, width=60, underpaint=how.underpaint, streaks=0.3)
    frame = render(scene, CAMERA, texture, underpaint=True, streaks=0.3)
    assert_identical(frame, steps)
    assert np.abs(frame.rgb - render(scene, CAMERA, texture).rgb).max() > 0.01
    path = [CAMERA, replace(CAMERA, near=0.02)]
    options = {"lock": "anchor", "order": "depth", "underpaint": True, "streaks": 0.3}
    for of_path in render_sequence(scene, path, texture, **options):
        assert_identical(of_path, frame)


def test_bad_values_are_refused_by_name():
    boxes = random_boxes(5, 20, 20)
    with pytest.raises(
        ValueError, match=r"rasterize: boxes must have setbacks .* project with underpaint=True"
    ):
        rasterize(boxes, SOLID, width=20, height=20, underpaint=UNDERPAINT)
    with pytest.raises(TypeError, match="rasterize: underpaint must be None or Underpaint, got bool"):
        rasterize(set_back(boxes, 1), SOLID, width=20, height=20, underpaint=True)
    for reach in (0, -1, np.inf, np.nan):
        with pytest.raises(ValueError, match="Underpaint: reach must be positive and finite"):
            Underpaint(reach)
    for opacity in (0, -0.1, 1.1, np.nan):
        with pytest.raises(ValueError, match="Underpaint: opacity must be above 0 to 1"):
            Underpaint(1, opacity)
    assert ProjectOptions().underpaint is False


# Stiff


STACKS = {
    "no setback": np.zeros(300),
    "a huge setback": np.full(300, 1e30),
    "beyond float32": np.full(300, 3e38),
    "equal sums": 9.0 - np.linspace(1, 9, 300),
    "one giant": np.where(np.arange(300) == 5, 1e6, 1e-3),
}


@for_each("dtype", [np.float32, np.float64])
@for_each("softness", [None, 0.0, 1.0])
@for_each("n", [0, 1])
def test_one_box_and_none(n, softness, dtype):
    boxes = set_back(random_boxes(5, 20, 20, sizes=(5, 9), dtype=dtype).take(np.s_[:n]), 1.0)
    boxes = boxes if softness is None else replace(boxes, softness=np.full(n, softness, dtype))
    for width, height in ((1, 1), (40, 20)):
        actual, expected = painted(boxes, "mip", width, height)
        np.testing.assert_allclose(actual.rgb, expected.rgb, atol=1e-4 if dtype == np.float32 else 1e-12)
        assert actual.alpha.any() == expected.alpha.any()
