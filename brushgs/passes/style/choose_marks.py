"""Assign marks of a painting to strokes, by color, local contrast and chance.

A mark laid in a color near its own keeps its bristles. Contrast is matched by rank: the calmest places of a
scene get the calmest marks of the painting, the busiest places its broken marks. Where a scene is busier than
the painting at the same rank, strokes move toward the mean color around them. Marks of a subject yield to its
own detail: marks and detail together have the contrast of the painting, so busy places get calm marks. The
choice is made once, from strokes in space: a stroke keeps its mark in every view.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

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

NUM_BEST = 6  # marks that a stroke chooses from
NUM_NEIGHBORS = 24  # strokes that make up the surroundings of one
OF_CONTRAST = 4.0  # weight of contrast relative to color
TAKES, WHICH = 5, 6  # indices of random draws, see `chances`


class Choice(NamedTuple):
    """Marks that strokes may take.

    Attributes:
        marks: of a painting.
        rows: of its marks in the brush set.
        share: of the strokes that take one, 0 to 1.
        yields: how far marks leave contrast to the detail of the scene, 0 to 1.
    """

    marks: MarkDictionary
    rows: NDArray[np.integer]
    share: float
    yields: float = 0.0


def choose_marks(
    strokes: Gaussians,
    choices: Sequence[Choice],
    *,
    first: float = 0.0,
    seed: int = 0,
) -> Gaussians:
    """Give a share of the strokes marks of paintings, evenly over the scene.

    A hash of place and seed decides which strokes take marks: as the share grows, more strokes take one and
    none gives it back. Each takes one of the six marks most similar to it.

    Args:
        strokes: k strokes in their final colors; if they have no brushes, their own brush is row 0 of the
            set.
        choices: with shares of at most 1 in sum.
        first: share of strokes to leave alone, because they already have brushes of other styles.
        seed: 0 to 2^32 - 1.

    Returns:
        The strokes with new `brushes`, and calmer colors where the painting is calmer than the scene; the
        input itself if all shares are 0.
    """
    if not len(strokes) or all(one.share == 0 for one in choices):
        return strokes
    takes, which = (chances(strokes.means, seed, draw) for draw in (TAKES, WHICH))
    lab = oklab_of(np.clip(base_colors(strokes.sh), 0, 1))
    means, contrasts = _around(strokes, lab)
    ranks = _ranks(contrasts)
    least = float(np.finfo(np.float32).tiny)
    typical = max(float(contrasts.mean()), least)
    brushes = np.zeros(len(strokes), np.uint8) if strokes.brushes is None else strokes.brushes.copy()
    kept = np.ones(len(strokes))
    for marks, rows, share, yields in choices:
        chosen = np.flatnonzero((takes >= first) & (takes < first + share))
        factors, own = marks.factors_at(ranks[chosen]), contrasts[chosen] / typical
        # Squared contrasts within marks and between marks add up; on average both are equal.
        both = 2 * (factors * marks.mean_contrast) ** 2
        between = (1 - yields) * own * marks.mean_contrast + yields * contrasts[chosen]
        within = np.sqrt(np.maximum(both - between**2, 0))
        best = _most_like(marks, lab[chosen], within)
        pick = (which[chosen] * best.shape[1]).astype(np.intp)
        brushes[chosen] = np.asarray(rows, np.uint8)[best[np.arange(len(best)), pick]]
        kept[chosen] = factors / np.clip(own, least, 1)
        first += share
    return _calmed(replace(strokes, brushes=brushes), lab, means, kept)


def _calmed(strokes: Gaussians, lab: F64, means: F64, kept: F64) -> Gaussians:
    """Strokes that keep a share [k], at most 1, of their color difference from the mean around them."""
    rows = np.flatnonzero(kept < 1)
    shifts = np.zeros_like(lab)
    calm = means[rows] + kept[rows, None] * (lab[rows] - means[rows])
    shifts[rows] = rgb_of_oklab(calm) - rgb_of_oklab(lab[rows])
    return shift_base_colors(strokes, shifts)


def _around(strokes: Gaussians, lab: F64) -> tuple[F64, F64]:
    """[k, 3] mean color around each stroke, itself included, and [k] deviation of lightness there, OKLab."""
    others = nearest_others(strokes.means.astype(np.float64), NUM_NEIGHBORS)
    near = lab[np.column_stack([np.arange(len(lab)), others])]
    return near.mean(axis=1), near[..., 0].std(axis=1)


def _ranks(values: F64) -> F64:
    """[k] rank of each value: the share of values below it, plus half the share equal to it."""
    _, place, counts = np.unique(values, return_inverse=True, return_counts=True)
    return np.asarray(((np.cumsum(counts) - 0.5 * counts) / len(values))[place])


def _most_like(marks: MarkDictionary, lab: F64, contrasts: F64) -> NDArray[np.int64]:
    """[k, b] rows of the marks most similar to each stroke, best first."""
    own = np.column_stack([marks.colors.astype(np.float64), OF_CONTRAST * marks.contrasts])
    return nearest(own, np.column_stack([lab, OF_CONTRAST * contrasts]), min(NUM_BEST, len(own)))[1]
