"""Strokes -> the same strokes, each with a mark of a painting: by color, contrast around it, and chance.

A mark of the color of a stroke keeps its bristles when it is laid in it. Contrast is matched by rank: where
a scene is calmest the calmest marks of the painting are laid, and broken ones where it is busiest. Strokes of
places that are not as calm as the painting's, for their rank, come nearer to the color around them. The
choice is made once, from strokes in space: a stroke keeps its mark in every view.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from brushgs.passes.form.coverage import nearest_others
from brushgs.passes.neighbours import nearest
from brushgs.passes.reduce.equal_rows import chances
from brushgs.values.arrays import F64
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors, shift_base_colors
from brushgs.values.style import MarkDictionary

NUM_BEST = 6  # marks that a stroke chooses among
NUM_NEIGHBORS = 24  # strokes whose colors are its surroundings
OF_CONTRAST = 4.0  # weight of contrast, colors 1
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
        strokes: k strokes in the colors that they are painted in; without brushes theirs is row 0.
        choices: dictionaries, the rows of their marks in the brush set, and the share of the strokes that
            take one of them; shares are 0 to 1, at most 1 in all.
        first: share of the strokes that are left alone, as they have taken other brushes of styles.
        seed: 0 to 2^32 - 1.

    Returns:
        The strokes with other `brushes`, and calmer colors where the painting is calmer than they are; the
        input itself where no share is above 0.
    """
    if not len(strokes) or all(share == 0 for _, _, share in choices):
        return strokes
    takes, which = (chances(strokes.means, seed, draw) for draw in (TAKES, WHICH))
    lab = oklab_of(np.clip(base_colors(strokes.sh), 0, 1))
    means, contrasts = _around(strokes, lab)
    ranks = _ranks(contrasts)
    least = float(np.finfo(np.float32).tiny)
    typical = max(float(contrasts.mean()), least)
    brushes = np.zeros(len(strokes), np.uint8) if strokes.brushes is None else strokes.brushes.copy()
    kept = np.ones(len(strokes))
    for marks, rows, share in choices:
        chosen = np.flatnonzero((takes >= first) & (takes < first + share))
        factors, own = marks.factors_at(ranks[chosen]), contrasts[chosen] / typical
        # Squares of what is within marks, and between them, add up; on average both are alike.
        within = np.sqrt(np.maximum(2 * factors**2 - own**2, 0)) * marks.mean_contrast
        best = _most_like(marks, lab[chosen], within)
        pick = (which[chosen] * best.shape[1]).astype(np.intp)
        brushes[chosen] = np.asarray(rows, np.uint8)[best[np.arange(len(best)), pick]]
        kept[chosen] = factors / np.clip(own, least, 1)
        first += share
    return _calmed(replace(strokes, brushes=brushes), lab, means, kept)


def _calmed(strokes: Gaussians, lab: F64, means: F64, kept: F64) -> Gaussians:
    """Strokes that keep a share [k] of what their colors differ by from the means around them, at most 1."""
    rows = np.flatnonzero(kept < 1)
    shifts = np.zeros_like(lab)
    calm = means[rows] + kept[rows, None] * (lab[rows] - means[rows])
    shifts[rows] = rgb_of_oklab(calm) - rgb_of_oklab(lab[rows])
    return shift_base_colors(strokes, shifts)


def _around(strokes: Gaussians, lab: F64) -> tuple[F64, F64]:
    """[k, 3] mean color of each stroke and those around it, and [k] deviation of their lightness, OKLab."""
    others = nearest_others(strokes.means.astype(np.float64), NUM_NEIGHBORS)
    near = lab[np.column_stack([np.arange(len(lab)), others])]
    return near.mean(axis=1), near[..., 0].std(axis=1)


def _ranks(values: F64) -> F64:
    """[k] the share of the values that is below each, and half of what is equal to it."""
    _, place, counts = np.unique(values, return_inverse=True, return_counts=True)
    return np.asarray(((np.cumsum(counts) - 0.5 * counts) / len(values))[place])


def _most_like(marks: MarkDictionary, lab: F64, contrasts: F64) -> NDArray[np.int64]:
    """[k, b] rows of the marks most like each stroke, the best first."""
    own = np.column_stack([marks.colors.astype(np.float64), OF_CONTRAST * marks.contrasts])
    return nearest(own, np.column_stack([lab, OF_CONTRAST * contrasts]), min(NUM_BEST, len(own)))[1]
