"""Charcoal and chalk on toned paper: a smudge of soft tone, dark marks in the tooth, white chalk, lines.

Tones, not colours: tones as light as the paper stay paper. Marks are pressed through the tooth, and only
where the smudge shows the same surface. Constants were settled by eye on five captured scenes.
"""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from brushgs.options.media import Charcoal
from brushgs.pipeline.media.materials import BACKDROP, Materials, mixed, numbers_of, scaled
from brushgs.rendering.coat import Coat
from brushgs.values.colors import oklab_of, rgb_of
from brushgs.values.sh import base_colors, in_colors

if TYPE_CHECKING:
    from brushgs.pipeline.media.staging import Staging

SMUDGE_POWER = 1.4  # of darkness: light tones stay paper
REACH = 1.1  # of the smudge, relative to the strokes
LEAST_MARK = 0.12  # opacity of the faintest mark, relative to the darkest
STAGE, STAGE_BORDER = 1.9, 0.1  # darkness of the masses around a subject, and their margin in the picture
CHALK = (0.98, 0.97, 0.94)
CHALK_RANGE = 0.22  # range of tones over which chalk becomes opaque


def charcoal(materials: Materials) -> list[Coat]:
    """The coats of a drawing in charcoal."""
    media, strokes, tones = numbers_of(Charcoal, materials), materials.strokes, materials.tones
    black, dark = rgb_of(media.color), 1 - tones
    soft = in_colors(strokes, mixed(materials.paper, black, media.wash * dark**SMUDGE_POWER))
    coats = [materials.smudge("smudge", scaled(soft, REACH, REACH, opacities=1.5 * strokes.opacities))]
    pressed = np.clip((media.middle - tones) / media.middle, 0, 1)
    marked = np.flatnonzero(pressed > 0)
    opacities = media.marks * (LEAST_MARK + (1 - LEAST_MARK) * pressed) * materials.solidity
    marks = in_colors(scaled(strokes, 1.15, 0.75, opacities=opacities), black).take(marked)
    coats.append(materials.marks("marks", marks, dry=media.dry))
    light = np.flatnonzero(tones > media.white)
    if media.chalk and len(light):
        opacities = (
            media.chalk * np.clip((tones - media.white) / CHALK_RANGE + 0.1, 0, 1) * materials.solidity
        )
        chalk = in_colors(scaled(strokes, 1.0, 0.8, opacities=opacities), CHALK).take(light)
        coats.append(materials.marks("chalk", chalk, dry=media.chalk_dry))
    return coats + materials.line_coat(rgb_of(media.line_color), opacity=media.lines, dry=media.line_dry)


def stage(materials: Materials, staging: "Staging") -> Coat:
    """A stage in smudged masses, darker in the shadow; tones as light as the paper stay paper."""
    strokes = staging.painted()
    paper = oklab_of(np.array([materials.paper]))[0, 0]
    dark = np.clip(1 - oklab_of(base_colors(strokes.sh).astype(np.float64))[:, 0] / paper, 0, 1)
    colors = mixed(
        materials.paper,
        rgb_of(numbers_of(Charcoal, materials).color),
        numbers_of(Charcoal, materials).wash * STAGE * dark,
    )
    coat = materials.smudge(BACKDROP, in_colors(strokes, colors))
    return replace(coat, border=STAGE_BORDER)
