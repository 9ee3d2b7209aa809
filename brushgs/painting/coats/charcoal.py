"""Charcoal and chalk on toned paper: a smudge of soft tone, dark marks in the tooth, white chalk, lines.

Tones, not colours: what is as light as the paper stays paper. Marks are pressed through the tooth, and lie
only where the smudge shows the same surface. Constants were settled by eye on five captured scenes.
"""

import numpy as np

from brushgs.colors import rgb_of
from brushgs.painting.coats.materials import Materials, mixed, scaled
from brushgs.rendering.coat import Coat
from brushgs.sh import in_colors

SMUDGE_POWER = 1.4  # of darkness: light tones stay paper
REACH = 1.1  # of the smudge, in that of the strokes
LEAST_MARK = 0.12  # opacity of the faintest mark, in that of the darkest
CHALK = (0.98, 0.97, 0.94)
CHALK_RANGE = 0.22  # tones over which chalk gets opaque


def charcoal(materials: Materials) -> list[Coat]:
    """The coats of a drawing in charcoal."""
    media, strokes, tones = materials.media, materials.strokes, materials.tones
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
