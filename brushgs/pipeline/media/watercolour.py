"""Watercolour on white paper: a pale wet wash, glazes that multiply, smaller ones in the dark, thin lines.

Lights are bare paper: nothing is painted white. Colours are lightened first, since overlapping glazes are
darker than each alone.
Source: Bousseau et al. 2006 (density of pigment, dark edges).
"""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from brushgs.options.media import Watercolour
from brushgs.pipeline.media.materials import BACKDROP, Materials, mixed, numbers_of, scaled
from brushgs.rendering.coat import Coat
from brushgs.values.colors import rgb_of, rgb_of_oklab
from brushgs.values.sh import base_colors, in_colors

if TYPE_CHECKING:
    from brushgs.pipeline.media.staging import Staging

PALEST = 1.15  # tone of a wash of clear water
SHADOW_LAB = (0.62, 0.006, -0.035)  # OKLab of the wash of a cast shadow: a cool violet
DETAIL_TONE = 0.30  # below which there are smaller glazes


def watercolour(materials: Materials) -> list[Coat]:
    """The coats of a watercolour."""
    media, strokes, tones = numbers_of(Watercolour, materials), materials.strokes, materials.tones
    pale = np.clip(PALEST - tones, 0, 1) * media.wash
    soft = in_colors(strokes, mixed(materials.paper, base_colors(strokes.sh), pale))
    coats = [materials.smudge("wash", scaled(soft, 1.15, 1.15, opacities=1.6 * strokes.opacities))]
    white = np.clip((tones - media.white) / max(1 - media.white, 1e-6), 0, 1)
    opacities = media.marks * (1 - 0.9 * white) * materials.solidity
    glazes = scaled(strokes, 1.12, 1.12, opacities=opacities)
    coats.append(materials.glaze("glazes", glazes, dry=media.dry))
    if media.details:
        dark = np.flatnonzero(tones < DETAIL_TONE)
        details = scaled(strokes, 0.9, 0.6, opacities=media.details * materials.solidity).take(dark)
        coats.append(materials.glaze("details", details, dry=media.dry))
    return coats + materials.line_coat(rgb_of(media.line_color), opacity=media.lines, dry=media.line_dry)


def stage(materials: Materials, staging: "Staging") -> Coat:
    """White paper with one wash of shadow."""
    from brushgs.passes.add.stage_marks import WASH

    color = np.clip(rgb_of_oklab(np.array([SHADOW_LAB])), 0, 1)[0]
    strokes = staging.finished(in_colors(staging.shadow(WASH), color))
    coat = materials.glaze(BACKDROP, strokes, dry=numbers_of(Watercolour, materials).dry)
    return replace(coat, tolerance=None)
