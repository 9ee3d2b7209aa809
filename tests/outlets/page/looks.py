"""Paintings in the looks of the program, and how far a picture of the page is from them."""

from dataclasses import replace

import numpy as np

from brushgs.options.look import Look
from brushgs.pipeline.prepare import PICTURE, prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.runner import Memory

STROKES = 1000
MEMORY = Memory()  # looks of one scene share what none of them changes


def painted_in(look, scene, camera, *, lock, **options):
    """A look in few strokes, made without views, and the background; options are parts of its painting."""
    config = Look.open(look).config
    config = replace(
        config,
        cluster=replace(config.cluster, strokes=STROKES),
        strokes=replace(config.strokes, see="off"),
        draw=replace(config.draw, order="depth", lock=lock),
        **{name: replace(getattr(config, name), **changes) for name, changes in options.items()},
    )
    found = prepare(scene, config, Report(), views=camera, asks=PICTURE, memory=MEMORY)
    return found.painting, found.background


def on_ground(painting, camera, background):
    """What is seen of a painting: on its surface, or over a background."""
    frame = painting.frame(camera)
    return frame.rgb if painting.surface is not None else frame.over(background)


def psnr(page, exact):
    difference = np.clip(page[..., :3], 0, 1) - np.clip(exact, 0, 1)
    return -10 * np.log10(np.mean(difference.astype(np.float64) ** 2))
