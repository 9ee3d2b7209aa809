"""Every look in the page against the exact painting of the same strokes."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.options.choices import LOOKS
from brushgs.options.look import Look
from brushgs.painting.prepare import prepare
from brushgs.painting.report import Report
from brushgs.still_life import still_life_camera
from tests.scenes import still_life_of

STROKES = 1000
SIZES = {"linen": (480, 360), "paper": (320, 240), "none": (160, 120)}  # at which threads begin to show
UNLIT = ("watercolour", "charcoal", "ink", "plain")  # looks without a lamp


@pytest.fixture(scope="module")
def scene():
    return still_life_of(6000)


@pytest.mark.parametrize(
    ("look", "relief"),
    [(look, None) for look in LOOKS] + [(look, 0.6) for look in ("watercolour", "charcoal")],
)
def test_the_page_paints_every_look_as_the_exact_renderer_does(studio, scene, look, relief):
    """Oil is within 64 dB, gouache 62, impressionist 61, watercolour 59, plain 55, ink 52, charcoal 50."""
    config = Look.open(look).config
    light = config.light if relief is None else replace(config.light, relief=relief)
    config = replace(
        config,
        cluster=replace(config.cluster, strokes=STROKES),
        draw=replace(config.draw, order="depth", lock="anchor"),
        light=light,
        ground=replace(config.ground, backdrop_always=True),
    )
    width, height = SIZES[light.canvas]
    camera = still_life_camera(width=width, height=height)
    found = prepare(scene, config, Report(), views=camera, needs_first_view=True)
    assert (found.painting.lamp is not None) == (relief is not None or look not in UNLIT)

    contents = studio.load(found.painting, camera, background=found.background)
    assert contents.omitted == ()
    page = studio.paint(camera, ground=True)
    frame = found.painting.frame(camera)
    exact = frame.rgb if found.painting.surface is not None else frame.over(found.background)
    assert (page[..., 3] > 0.999).all()
    difference = np.clip(page[..., :3], 0, 1) - np.clip(exact, 0, 1)
    psnr = -10 * np.log10(np.mean(difference.astype(np.float64) ** 2))
    assert psnr > 45
    assert (np.abs(difference).max(axis=2) <= 4 / 255).mean() >= 0.99
