"""Streaks: bristles that leave lines of lighter and darker paint along a stroke."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering import reference
from brushgs.rendering.backward import BOX_COLUMNS, rasterize_backward
from brushgs.rendering.rasterize import rasterize
from brushgs.rendering.streaks import (
    BRISTLES,
    MOST_STREAKS,
    PERIOD,
    noise,
    streak_slopes,
    streak_weights,
)
from brushgs.values.boxes import Boxes
from brushgs.values.frame import Frame
from tests.differences import assert_same_gradient, central_differences
from tests.kit.for_each import for_each
from tests.pairs import pairs_of
from tests.rendering.strokes import PATHS, boxes_of, random_boxes, softened, texture_of

IMAGES = [path for path, (kind, _) in PATHS.items() if kind == "image"]
KERNELS = [path for path, (kind, _) in PATHS.items() if kind != "image"]
SOLID = StrokeTexture.from_coverage(np.ones((2, 2)))


def painted(boxes: Boxes, path: str, width: int, height: int, streaks: float) -> tuple[Frame, Frame]:
    """What the kernel paints, and what it should."""
    kind, filter = PATHS[path]
    how = {"width": width, "height": height, "filter": filter, "streaks": streaks}
    expected = reference.rasterize(boxes, texture_of(kind), **how)
    return kernel_of(boxes, path, width, height, streaks), expected


def kernel_of(boxes: Boxes, path: str, width: int, height: int, streaks: float) -> Frame:
    """What the kernel paints; the definition takes a hundred times as long."""
    kind, filter = PATHS[path]
    return rasterize(boxes, texture_of(kind), width=width, height=height, filter=filter, streaks=streaks)


@for_each(("path", "streaks", "softness"), pairs_of(IMAGES, (0.01, 0.5), (None, 0.5)))
def test_kernel_agrees_with_the_definition(path, streaks, softness):
    boxes = random_boxes(100, 75, 50, seed=3, sizes=(0.3, 60))
    boxes = boxes if softness is None else softened(boxes, softness)
    actual, expected = painted(boxes, path, 75, 50, streaks)
    plain = kernel_of(boxes, path, 75, 50, 0.0)
    for name in ("rgb", "alpha", "depth"):
        np.testing.assert_allclose(getattr(actual, name), getattr(expected, name), rtol=1e-9, atol=1e-11)
    for name in ("alpha", "depth"):
        np.testing.assert_array_equal(getattr(actual, name), getattr(plain, name))
    ratio = actual.rgb[plain.rgb > 0.01] / plain.rgb[plain.rgb > 0.01]
    assert np.abs(ratio - 1).max() <= streaks * (1 + 1e-12)
    assert np.abs(ratio - 1).max() > 0.3 * streaks
    single = kernel_of(boxes.astype(np.float32), path, 75, 50, streaks)
    off = np.abs(single.rgb - expected.rgb).max(axis=2)
    assert (off > 2e-4).mean() <= 2e-3
    assert off[off <= 2e-4].mean() < 5e-6


def test_streaks_run_along_the_stroke():
    """Constant along u; across v it changes about as often as there are bristles, at every angle."""
    for row in (0, 1, 77, 5000):
        boxes = replace(boxes_of([[60, 60]], (50, 30), colors=0.5), ids=np.array([row], np.int32))
        rgb = rasterize(boxes, SOLID, width=120, height=120, filter="bilinear", streaks=0.4).rgb
        inside = rgb[31:89, 11:109, 0]
        np.testing.assert_allclose(inside, inside[:, :1].repeat(98, axis=1), rtol=1e-12)
        turns = np.count_nonzero(np.diff(np.sign(np.diff(inside[:, 0]))))
        assert BRISTLES / 4 < turns <= BRISTLES
        turned = replace(boxes, angles=np.array([np.pi / 2]))
        across = rasterize(turned, SOLID, width=120, height=120, filter="bilinear", streaks=0.4).rgb
        np.testing.assert_allclose(across[11:109, 31:89, 0], inside.T[:, ::-1], atol=1e-9)


def test_noise_has_mean_zero_and_repeats_with_its_sign_changed():
    values = noise().astype(np.float64) / 127.5 - 1
    assert values.shape == (PERIOD, 2)
    np.testing.assert_allclose(values.mean(axis=0), 0, atol=1e-15)
    assert np.abs(values).max() <= 1
    assert (values.std(axis=0) > 0.4).all()
    # Tufts are smoother than bristles.
    steps = np.abs(np.diff(values, axis=0)).mean(axis=0)
    assert steps[1] < 0.5 * steps[0]


def test_streaks_fade_before_bristles_get_as_narrow_as_a_pixel():
    half_v = np.array([0, 1e-30, 1, 1.5, 3, 6, 12, 100, 3e38])
    boxes = boxes_of(np.zeros((9, 2)), np.stack([np.full(9, 5.0), half_v], 1))
    weights = streak_weights(boxes, 0.4)
    np.testing.assert_allclose(weights.sum(axis=1)[:4], 0)  # a tuft under two pixels
    np.testing.assert_allclose(weights.sum(axis=1)[4:], 0.4)
    np.testing.assert_allclose(weights[:6, 0], 0)  # a bristle under a pixel
    np.testing.assert_allclose(weights[6:, 0], 0.4)
    assert (weights >= 0).all()
    fine = boxes_of(np.zeros((4000, 2)), np.stack([np.full(4000, 5.0), np.linspace(0, 20, 4000)], 1))
    slopes = np.diff(streak_weights(fine, 0.4), axis=0) / (20 / 3999)
    middle = 0.5 * (streak_slopes(fine, 0.4)[1:] + streak_slopes(fine, 0.4)[:-1])
    np.testing.assert_allclose(slopes, middle, atol=1e-3)


@pytest.mark.parametrize("path", IMAGES)
def test_gradients_are_differences_of_the_definition(path):
    """Of boxes in which one band fades, both do, or neither."""
    kind, filter = PATHS[path]
    texture, g = texture_of(kind), np.random.default_rng(9)
    size, how = {"width": 61, "height": 43}, {"filter": filter, "streaks": 0.5}
    boxes = random_boxes(8, **size, seed=4, sizes=(8, 25))
    half_extents = np.array(boxes.half_extents)
    half_extents[:, 1] = (2, 2.6, 5, 7.5, 9, 11, 14, 25)
    boxes = replace(boxes, half_extents=half_extents, opacities=np.linspace(0.2, 0.9, 8))
    v_rgb, v_alpha, v_depth = (g.normal(size=s) for s in ((43, 61, 3), (43, 61), (43, 61)))
    frame = rasterize(boxes, texture, **size, **how)
    actual = rasterize_backward(boxes, texture, frame, v_rgb, v_alpha, {"depth": v_depth}, **how)
    for name in BOX_COLUMNS:

        def loss(values, name=name):
            changed = replace(boxes, **{name: values})
            frame = reference.rasterize(changed, texture, **size, **how)
            return float((frame.rgb * v_rgb).sum() + (frame.alpha * v_alpha + frame.depth * v_depth).sum())

        # Closer than usual: a step of 1e-6 takes a pixel over a texel's edge.
        numerical = central_differences(loss, getattr(boxes, name), step=1e-7)
        assert numerical.any()
        assert_same_gradient(f"{path} {name}", getattr(actual, name), numerical)


@for_each("streaks", [-0.1, MOST_STREAKS + 0.01, np.nan, np.inf])
def test_an_amplitude_out_of_range_is_refused_by_name(streaks):
    boxes = random_boxes(5, 20, 20)
    with pytest.raises(ValueError, match=r"rasterize: streaks must be in 0 to 0.5, got"):
        rasterize(boxes, SOLID, width=20, height=20, streaks=streaks)
