"""Strokes -> the same strokes, each with its brush: by its shape, its size and chance, never by the view.

A painter draws long strokes with a flat and touches with a dab; one image for all is seen at once. The choice
depends on the stroke in space alone, so a stroke keeps its brush while the camera moves.
The bounds were found by trial on captured scenes.
"""

import operator
from dataclasses import replace

import numpy as np

from brushgs.arrays import F64
from brushgs.brushes.kit import BrushKit
from brushgs.passes.equal_rows import chances
from brushgs.scene import Gaussians

LONG, SHORT = 1.9, 1.35  # length over width above and below which strokes are long and short
LARGE = 2.2  # times the median size
MAX_SEED = 2**32 - 1


def choose_brushes(strokes: Gaussians, kit: BrushKit, *, seed: int = 0) -> Gaussians:
    """Give each stroke a brush of a kit.

    Long strokes (largest over second scale above 1.9) take the brushes `kit.long`, short ones (below 1.35)
    `kit.short`, the rest `kit.other`. Strokes of more than 2.2 times the median size (the geometric mean of
    the two larger scales) choose among `kit.large` as well. Which one of several is a hash of the place of
    the stroke and the seed: it does not depend on the order of the strokes.

    Args:
        strokes: k strokes.
        kit: the brushes.
        seed: 0 to 2^32 - 1; another one chooses otherwise.

    Returns:
        The strokes with `brushes`, rows of `kit.open()`.

    Raises:
        TypeError: if `seed` is not an integer.
        ValueError: if it is out of range, or the kit has more than 256 images.
    """
    seed = operator.index(seed)
    if not 0 <= seed <= MAX_SEED:
        raise ValueError(f"choose_brushes: seed must be in 0 to {MAX_SEED}, got {seed}")
    rows = kit.rows()
    large = rows["large"]
    aspects, sizes = _shapes(strokes)
    shares = chances(strokes.means, seed, 4)
    brushes = np.zeros(len(strokes), np.uint8)
    is_large = sizes > LARGE * np.median(sizes) if len(strokes) else np.zeros(0, bool)
    is_long, is_short = aspects > LONG, aspects < SHORT
    groups = {"long": is_long, "short": is_short, "other": ~(is_long | is_short)}
    for group, is_in in groups.items():
        for some, choice in (
            (is_in & ~is_large, rows[group]),
            (is_in & is_large, np.union1d(rows[group], large)),
        ):
            brushes[some] = choice[(shares[some] * len(choice)).astype(np.intp)]
    return replace(strokes, brushes=brushes)


def _shapes(strokes: Gaussians) -> tuple[F64, F64]:
    """[k] length over width of each stroke, and its size in world units."""
    scales = np.sort(strokes.scales, axis=1)[:, 1:].astype(np.float64)
    width, length = scales.T
    aspects = np.divide(length, width, out=np.full(len(strokes), np.inf), where=width > 0)
    return np.where(length > 0, aspects, 1.0), np.sqrt(length) * np.sqrt(width)
