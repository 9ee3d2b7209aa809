"""Adjusting strokes adjusts the picture; a swap moves one color and leaves the rest."""

import numpy as np

import brushgs as bg
from brushgs.measure.likeness import psnr
from brushgs.options.styling import AdjustConfig
from brushgs.passes.color.adjust import Swap, adjust_map
from brushgs.passes.color.color_map import map_colors
from brushgs.still_life import still_life_camera
from brushgs.values.colors import LUMINANCE, rgb_of
from tests.kit.for_each import for_each
from tests.scenes import still_life_of

COLORS = np.random.default_rng(3).random((500, 3))
GREEN, RED = "#3a5f0b", "#7a1f1f"


def code(text):
    return np.array(rgb_of(text))


def mapped(rgb, **options):
    return adjust_map(AdjustConfig(**options)).colors(np.atleast_2d(np.asarray(rgb, np.float64)))


def test_each_option_does_what_its_name_says():
    np.testing.assert_allclose(mapped(COLORS), COLORS, atol=1e-15)
    np.testing.assert_allclose(mapped(COLORS, brightness=0.1), COLORS + 0.1)
    np.testing.assert_allclose(mapped(COLORS, contrast=1.5), 0.5 + 1.5 * (COLORS - 0.5))
    grey = mapped(COLORS, saturation=0)
    np.testing.assert_allclose(grey, (COLORS @ LUMINANCE)[:, None] * np.ones(3))
    np.testing.assert_allclose(mapped(COLORS, saturation=2) @ LUMINANCE, COLORS @ LUMINANCE)
    warm, cool = (mapped([0.5, 0.5, 0.5], temperature=t)[0] for t in (1, -1))
    assert warm[0] > 0.55 > 0.40 > warm[2]
    assert cool[2] > 0.60 > 0.45 > cool[0]
    np.testing.assert_allclose([warm @ LUMINANCE, cool @ LUMINANCE], 0.5)


def test_a_picture_of_adjusted_strokes_is_the_adjusted_picture():
    strokes = bg.cluster(still_life_of(), 600)
    camera, texture = still_life_camera(width=160, height=120), bg.StrokeTexture.open("flat")
    one = adjust_map(AdjustConfig(0.05, 0.8, 0.6, 0.5))
    ground = np.array([0.7, 0.6, 0.5])
    before = bg.render(strokes, camera, texture).over(ground)
    after = bg.render(map_colors(strokes, one), camera, texture).over(one.colors(ground[None])[0])
    wanted = one.colors(before.reshape(-1, 3).astype(np.float64)).reshape(before.shape)
    assert np.abs(wanted - before).mean() > 0.02
    assert psnr(np.clip(after, 0, 1), np.clip(wanted, 0, 1)) > 100  # measured: 150


@for_each("text", [f"{GREEN}:{RED}", "#000000:#203050", "#ffffff:#f0e0c0", "#f0e0a0:#102040"])
def test_a_swap_gives_the_color_asked_for(text):
    np.testing.assert_allclose(Swap.of(text).colors(code(text[:7])[None])[0], code(text[8:]), atol=1e-9)
    swap = Swap.of(f"{GREEN}:{RED}")  # greys and other hues stay bit for bit
    still = np.concatenate([np.linspace(0, 1, 9)[:, None] * np.ones(3), [code("#2040c0"), code("#c02020")]])
    np.testing.assert_array_equal(swap.colors(still), still)
    both = mapped(code(GREEN), brightness=0.1, swaps=(f"{GREEN}:{RED}",))  # swaps come before the rest
    np.testing.assert_allclose(both[0], code(RED) + 0.1, atol=1e-9)


def test_derivatives_are_those_of_the_map():
    one = adjust_map(AdjustConfig(0.1, 1.2, 0.7, 0.3, swaps=(f"{GREEN}:{RED}", "#c02020:#2040c0")))
    some = np.clip(COLORS, 0.05, 0.95)
    slopes = one.slopes(some, one.colors(some))
    for channel, step in enumerate(1e-5 * np.eye(3)):
        found = (one.colors(some + step) - one.colors(some - step)) / 2e-5
        # Its own are taken over 0.002; at most 0.044 off, of slopes of up to 10 where a swap ends.
        np.testing.assert_allclose(slopes[:, :, channel], found, atol=0.05)
