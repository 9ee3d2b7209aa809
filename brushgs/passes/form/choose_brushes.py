"""Choose a brush for each stroke by shape, size, surface and chance, never by the view.

One image for all strokes is conspicuous; painters use a flat for long strokes, a dab for touches, a knife for
a light wall and a dry brush for fur. The choice depends only on the strokes in space, so a stroke keeps its
brush while the camera moves. The bounds were found by trial on captured scenes.
"""

import operator
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.kit import BrushKit
from brushgs.core.native import core as _core
from brushgs.passes.form.material import brush_arguments
from brushgs.passes.reduce.equal_rows import chances
from brushgs.values.gaussians import Gaussians

GROUPS = ("long", "short", "other", "large", "smooth", "rough")  # of a kit, in the order of the core
MAX_SEED = 2**32 - 1
ROUNDING = 1e-9  # tolerance of a sum of shares


def choose_brushes(strokes: Gaussians, kit: BrushKit, *, material: float = 0.0, seed: int = 0) -> Gaussians:
    """Give each stroke a brush of a kit.

    Long strokes (largest over second scale above 1.9) take the brushes `kit.long`, short ones (below 1.35)
    `kit.short`, the rest `kit.other`. Strokes above 2.2 times the median size (geometric mean of the two
    larger scales) may also take `kit.large`. A hash of position and seed selects among several, independent
    of the order of strokes.

    Args:
        strokes: k strokes.
        kit: the brushes.
        material: 0 to 1, share of strokes on smooth and light surfaces that take `kit.smooth` instead, and on
            rough ones `kit.rough`, if the kit has any. Monotonic: a larger share only adds strokes. See
            `passes.form.material`.
        seed: 0 to 2^32 - 1.

    Returns:
        The strokes with `brushes`, rows of `kit.open()`.

    Raises:
        TypeError: if `seed` is not an integer.
        ValueError: if `seed` or `material` is out of range, or the kit has more than 256 images.

    Example:
        >>> kit = bg.BrushKit(long=("flat",), short=("dab",))
        >>> chosen = bg.choose_brushes(strokes, kit)
        >>> chosen
        Gaussians(500, SH 3, brushes)
        >>> frame = bg.render(chosen, camera, kit.open())
    """
    _check_seed("choose_brushes", seed)
    if not 0 <= material <= 1:
        raise ValueError(f"choose_brushes: material must be 0 to 1, got {material:g}")
    rows = kit.rows()
    brushes = _core.choose_brushes(
        **brush_arguments(strokes),
        rows=[rows[group].tolist() for group in GROUPS],
        material=material,
        seed=seed,
    )
    return replace(strokes, brushes=np.asarray(brushes))


def mix_brushes(
    strokes: Gaussians, choices: Sequence[tuple[NDArray[np.uint8], float]], *, seed: int = 0
) -> Gaussians:
    """Give a share of the strokes other brushes, evenly over the scene.

    A hash of position and seed selects the strokes. Monotonic: a larger share only adds strokes.

    Args:
        strokes: k strokes; without `brushes` all have row 0.
        choices: pairs of rows of the brush set (one or more) and the share of strokes that take one of them;
            0 to 1, in total at most 1.
        seed: 0 to 2^32 - 1.

    Returns:
        The strokes with other `brushes`; the input itself if no share is above 0.

    Raises:
        TypeError: if `seed` is not an integer.
        ValueError: if it, or a share, is out of range, or a choice has no rows.
    """
    _check_seed("mix_brushes", seed)
    total = 0.0
    for rows, share in choices:
        total += share
        if not share >= 0 or total > 1 + ROUNDING:
            raise ValueError(f"mix_brushes: shares must be 0 to 1 and at most 1 in all, got {share:g}")
        if len(rows) == 0:
            raise ValueError("mix_brushes: a choice must have at least one row, got none")
    if total == 0:
        return strokes
    takes, which = (chances(strokes.means, seed, draw) for draw in (5, 6))
    brushes = np.zeros(len(strokes), np.uint8) if strokes.brushes is None else strokes.brushes.copy()
    first = 0.0
    for rows, share in choices:
        chosen = (takes >= first) & (takes < first + share)
        brushes[chosen] = np.asarray(rows, np.uint8)[(which[chosen] * len(rows)).astype(np.intp)]
        first += share
    return replace(strokes, brushes=brushes)


def _check_seed(where: str, seed: int) -> None:
    if not 0 <= operator.index(seed) <= MAX_SEED:
        raise ValueError(f"{where}: seed must be in 0 to {MAX_SEED}, got {seed}")
