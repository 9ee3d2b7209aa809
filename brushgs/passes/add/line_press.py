"""Press lines by the tone beside them: heavy on the dark side of a form, lost in the light."""

from dataclasses import replace

import numpy as np

from brushgs.passes.neighbours import nearest
from brushgs.values.along import Along
from brushgs.values.arrays import F64
from brushgs.values.gaussians import Gaussians
from brushgs.values.lines import Lines

NEAR, DARKEST = 10, 4  # strokes near a piece, and how many of them, the darkest, make up the dark side
LIGHT, DARK = 0.52, 0.12  # tones on the dark side: pressure is none from the first on, full up to the second
WIDTHS = (0.35, 1.6)  # of the least pressed line and the most, relative to the drawn width
LEAST = 0.06  # pressure below which a line is lost
REACH = 4  # pieces to each side over which pressure is averaged
UNEVEN, WAVE = 0.25, 9.0  # variation of a hand's pressure, and its period in pieces


def pressed(lines: Lines, strokes: Gaussians, tones: F64) -> Lines:
    """Give lines the weight of the tone beside them.

    Args:
        lines: L pieces.
        strokes: N strokes of the scene.
        tones: [N] of the strokes, 0 (black) to 1 (white).

    Returns:
        The remaining pieces, in their order, with other widths and opacities.
    """
    if len(lines) == 0 or len(strokes) == 0:
        return lines
    count = min(NEAR, len(strokes))
    _, rows = nearest(strokes.means, lines.strokes.means, count)
    near = np.sort(tones[rows], axis=1)
    side = near[:, : min(DARKEST, count)].mean(axis=1)
    along = Along.of(lines.chains)
    pressure = along.mean(np.clip((LIGHT - side) / (LIGHT - DARK), 0, 1), REACH)
    place = np.arange(len(lines)) - along.first
    pressure = pressure * (1 + UNEVEN * np.sin(2 * np.pi * place / WAVE + 2.4 * along.chains))
    pressure = np.clip(pressure, 0, 1)
    kept = np.flatnonzero(pressure > LEAST)
    least, most = WIDTHS
    own, pressure = lines.strokes.take(kept), pressure[kept]
    widths = (least + (most - least) * pressure).astype(own.scales.dtype)
    scales = own.scales.copy()
    scales[:, 1:] *= widths[:, None]  # the first axis runs along the line
    opacities = own.opacities * np.minimum(0.35 + 1.1 * pressure, 1)
    drawn = replace(own, scales=scales, opacities=opacities.astype(own.opacities.dtype))
    return Lines(drawn, lines.strengths[kept], lines.chains[kept], lines.normals[kept])
