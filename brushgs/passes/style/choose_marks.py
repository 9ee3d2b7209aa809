"""Strokes -> the same strokes, each with a mark of a painting: by colour, contrast around it, and chance.

A mark of the colour of a stroke keeps its bristles when it is laid in it; where a scene is calm calm marks
are laid, and broken ones where it is busy. The choice is made once, from strokes in space: a stroke keeps its
mark in every view.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from brushgs.passes.form.coverage import nearest_others
from brushgs.passes.neighbours import nearest
from brushgs.passes.reduce.equal_rows import chances
from brushgs.values.arrays import F64
from brushgs.values.colors import oklab_of
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors
from brushgs.values.style import MarkDictionary

NUM_BEST = 6  # marks that a stroke chooses among
NUM_NEIGHBORS = 6  # strokes whose colours are its surroundings
OF_CONTRAST = 0.5  # weight of contrast, colours 1
MOST_CONTRAST = 0.15  # OKLab: outlines of things are no broken colour
TAKES, WHICH = 5, 6  # draws, see `chances`


def choose_marks(
    strokes: Gaussians,
    choices: Sequence[tuple[MarkDictionary, NDArray[np.uint8], float]],
    *,
    first: float = 0.0,
    seed: int = 0,
) -> Gaussians:
    """Give a share of the strokes marks of paintings, evenly over the scene.

    Who takes them is a hash of the place and the seed: as a share grows, more strokes take marks and none
    gives them back. Each takes one of the six marks that are most like it.

    Args:
        strokes: k strokes in the colours that they are painted in; without brushes theirs is row 0.
        choices: dictionaries, the rows of their marks in the brush set, and the share of the strokes that
            take one of them; shares are 0 to 1, at most 1 in all.
        first: share of the strokes that are left alone, as they have taken other brushes of styles.
        seed: 0 to 2^32 - 1.

    Returns:
        The strokes with other `brushes`; the input itself where no share is above 0.
    """
    if not len(strokes) or all(share == 0 for _, _, share in choices):
        return strokes
    takes, which = (chances(strokes.means, seed, draw) for draw in (TAKES, WHICH))
    lab = oklab_of(np.clip(base_colors(strokes.sh), 0, 1))
    contrasts = _contrasts(strokes, lab)
    brushes = np.zeros(len(strokes), np.uint8) if strokes.brushes is None else strokes.brushes.copy()
    for marks, rows, share in choices:
        chosen = np.flatnonzero((takes >= first) & (takes < first + share))
        best = _most_like(marks, lab[chosen], contrasts[chosen])
        pick = (which[chosen] * best.shape[1]).astype(np.intp)
        brushes[chosen] = np.asarray(rows, np.uint8)[best[np.arange(len(best)), pick]]
        first += share
    return replace(strokes, brushes=brushes)


def _contrasts(strokes: Gaussians, lab: F64) -> F64:
    """[k] deviation of the lightness of the strokes around each, OKLab."""
    others = nearest_others(strokes.means.astype(np.float64), NUM_NEIGHBORS)
    if others.shape[1] == 0:
        return np.zeros(len(lab))
    away = lab[others, 0] - lab[:, :1]
    contrast: F64 = np.minimum(np.sqrt((away**2).mean(axis=1)), MOST_CONTRAST)
    return contrast


def _most_like(marks: MarkDictionary, lab: F64, contrasts: F64) -> NDArray[np.int64]:
    """[k, b] rows of the marks most like each stroke, the best first."""
    own = np.column_stack([marks.colors.astype(np.float64), OF_CONTRAST * marks.contrasts])
    return nearest(own, np.column_stack([lab, OF_CONTRAST * contrasts]), min(NUM_BEST, len(own)))[1]
