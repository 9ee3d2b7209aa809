"""Marks pressed through the tooth of a paper."""

from dataclasses import replace

import numpy as np

from brushgs.rendering.rasterize import rasterize
from brushgs.rendering.tooth import SOFTNESS, press
from brushgs.values.frame import Frame
from tests.kit.for_each import for_each
from tests.rendering.strokes import random_boxes


def frame_of(height: int = 37, width: int = 23, dtype=np.float64) -> Frame:
    g = np.random.default_rng(1)
    alpha = g.uniform(0, 1, (height, width))
    alpha[:3] = 0
    alpha[3:6] = 1
    rgb = alpha[..., None] * g.uniform(0, 1, (height, width, 3))
    return Frame(rgb.astype(dtype), alpha.astype(dtype), np.full((height, width), 2, dtype))


def expected(frame: Frame, grain, dry: float):
    e = np.clip((frame.alpha - dry * (1 - grain)) / SOFTNESS, 0, 1)
    share = e * e * (3 - 2 * e)
    return frame.rgb * share[..., None], frame.alpha * share


@for_each("dtype", [np.float32, np.float64])
@for_each("dry", [0, 0.2, 0.42, 1])
@for_each("size", [(37, 23), (1, 1), (16, 16), (40, 40)])
def test_pressed_marks_are_those_of_the_formula(size, dry, dtype):
    frame = frame_of(*size, dtype=dtype)
    grain = np.random.default_rng(2).uniform(0, 1, size)
    pressed = press(frame, grain, dry)
    rtol, atol = (1e-9, 1e-12) if dtype == np.float64 else (1e-4, 1e-6)
    rgb, alpha = expected(frame, grain, dry)
    np.testing.assert_allclose(pressed.rgb, rgb, rtol, atol)
    np.testing.assert_allclose(pressed.alpha, alpha, rtol, atol)
    assert pressed.rgb.dtype == pressed.alpha.dtype == dtype
    np.testing.assert_array_equal(pressed.depth, frame.depth)


def test_a_painted_frame_and_a_grain_of_another_dtype_and_layout_are_taken():
    frame = rasterize(random_boxes(50, 30, 20, dtype=np.float32), "flat", width=30, height=20)
    grain = np.random.default_rng(2).uniform(0, 1, (30, 20)).T
    once = press(frame, grain, 0.4)
    again = press(frame, np.ascontiguousarray(grain, np.float32), 0.4)
    np.testing.assert_array_equal(once.rgb, again.rgb)
    turned = replace(frame, rgb=np.asfortranarray(frame.rgb), alpha=np.asfortranarray(frame.alpha))
    np.testing.assert_array_equal(press(turned, grain, 0.4).rgb, once.rgb)
