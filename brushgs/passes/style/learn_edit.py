"""Learn the edit between two states of a scene, as a style for any scene.

    pairs of colors -> the simplest affine map -> its residual, by features of strokes

The edit must also hold where the scene gives no evidence: the affine map is the simplest that explains most
of it, and a residual is used only if it explains held-out parts of the scene. Both are weakened to the share
that holds for held-out colors.
"""

from dataclasses import dataclass

import numpy as np

from brushgs.cameras.framing import camera_axes
from brushgs.passes.reduce.contribution import paint_of
from brushgs.passes.reduce.lloyd import lloyd
from brushgs.passes.style.features import COLOR_FEATURES, color_features, stroke_features
from brushgs.passes.style.fit_affine import fit_affine
from brushgs.passes.style.fit_bumps import CANDIDATES, NOTHING, NUM_FOLDS, BumpFit, Samples, fit_bumps
from brushgs.passes.style.pairs import pair_rows
from brushgs.values.arrays import F64, Array, Rows
from brushgs.values.camera import FirstView
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0
from brushgs.values.style import StyleEdit

MOST_ROWS = 10_000  # for fitting an edit
SECTORS = 12  # around up; every fourth is held out at a time
LARGEST_SHARE = 0.99  # quantile that weights are capped at
NUM_BLOCKS = 12  # of colors; every fourth is held out at a time
SAME_SIZE = 1e-3  # of a log size: below, it is rounding
LOG_SIZE_WEIGHT = 0.3  # weight of a log size relative to a color


@dataclass(frozen=True, eq=False)
class LearntEdit:
    """An edit and how well it explains what it was learned from.

    Attributes:
        edit: the result.
        num_pairs: Gaussians compared.
        changed: root mean square difference of colors before and after.
        left: root mean square difference that the affine map leaves.
        held_out: what remains with the bumps, in held-out parts of the scene.
        kept: 0 to 1, the share of the best affine map in the edit that holds for held-out colors.
        bumps_kept: the same for the bumps.
    """

    edit: StyleEdit
    num_pairs: int
    changed: float
    left: float
    held_out: float
    kept: float = 1.0
    bumps_kept: float = 1.0


def learn_edit(
    before: Gaussians, after: Gaussians, first_view: FirstView, *, num_bumps: int | None = None
) -> LearntEdit:
    """Learn what was done to the colors and sizes of a scene.

    Args:
        before: the scene.
        after: the same scene, edited: its rows are those of `before`, or lie at the same places.
        first_view: of the scene before.
        num_bumps: largest number of bumps in the residual, 0 for none; None to choose.

    Raises:
        ValueError: if a scene is empty, or they are not two states of one.
    """
    pairs = pair_rows(before, after)
    weights = paint_of(before)
    rows, says = sampled(weights[pairs.before])
    first, second = pairs.before[rows], pairs.after[rows]
    colors, edited = (
        0.5 + C0 * scene.sh[some, 0].astype(np.float64) for scene, some in ((before, first), (after, second))
    )
    steps = _log_steps(before.scales[first], after.scales[second])
    return learn_from_colors(
        before, first, colors, edited, says, first_view, log_steps=steps, num_bumps=num_bumps
    )


def learn_from_colors(
    scene: Gaussians,
    rows: Rows,
    before: F64,
    after: F64,
    weights: F64,
    first_view: FirstView,
    *,
    log_steps: F64 | None = None,
    num_bumps: int | None = None,
) -> LearntEdit:
    """Learn an edit from known colors of some Gaussians.

    Args:
        scene: N Gaussians before the edit.
        rows: [n] rows of these, n >= 1.
        before: [n, 3] their colors before the edit.
        after: [n, 3] and after it.
        weights: [n] >= 0, of each row.
        first_view: of the scene.
        log_steps: [n] growth of the logarithms of their sizes; None for none.
        num_bumps: see `learn_edit`.
    """
    weights = np.minimum(weights, np.quantile(weights, LARGEST_SHARE))
    weights = weights if weights.any() else np.ones(len(rows))
    fit = fit_affine(before, after, weights)
    left = (after - before @ fit.affine[:, :3].T - fit.affine[:, 3]) * fit.known
    steps = np.zeros(len(rows)) if log_steps is None else log_steps
    log_size = float(np.median(steps))
    log_size = log_size if abs(log_size) > SAME_SIZE else 0.0
    shares = weights / weights.sum()
    changed, remains = (float(np.sqrt(shares @ (d**2).mean(axis=1))) for d in (after - before, left))
    sizes_left = LOG_SIZE_WEIGHT * (steps - log_size)
    has_sizes = bool(np.sqrt(shares @ sizes_left**2) > NOTHING)
    bumps = BumpFit(None, remains, remains)
    if (remains > NOTHING or has_sizes) and num_bumps != 0:
        candidates = [names for names in CANDIDATES if names != ("gloss",) or scene.sh.shape[1] > 1]
        others = [name for names in candidates for name in names if name not in COLOR_FEATURES]
        found = stroke_features(scene, first_view, tuple(dict.fromkeys(others)))
        wanted = np.column_stack([left, sizes_left]) if has_sizes else left
        says = shares[:, None] * np.column_stack([fit.known, np.ones(len(rows))])[:, : wanted.shape[1]]
        colors = color_features(before)
        samples = Samples(
            before,
            np.column_stack([colors, found.values[rows]]),
            COLOR_FEATURES + found.names,
            wanted,
            says,
            np.stack([_sectors(scene.means[rows], first_view), _color_blocks(colors)]),
        )
        bumps = fit_bumps(samples, candidates, most=num_bumps)
        if has_sizes and bumps.residual is not None:
            bumps.residual.weights[:, 3] /= LOG_SIZE_WEIGHT
    edit = StyleEdit(fit.affine, log_size, bumps.residual)
    return LearntEdit(edit, len(rows), changed, remains, bumps.held_out, fit.kept, bumps.kept)


def sampled(weights: F64, *, most: int = MOST_ROWS) -> tuple[Rows, F64]:
    """Rows of at most `most` strokes, ascending, and their weights.

    If there are more, rows are drawn with probability proportional to the roots of their weights [n], and
    those roots become their weights: large strokes are drawn more often, but small ones too.
    """
    if len(weights) <= most:
        return np.arange(len(weights)), weights
    roots = np.sqrt(weights) + 1e-3 * np.sqrt(weights.max()) + np.finfo(np.float64).tiny
    totals = np.cumsum(roots)
    rows = np.unique(np.searchsorted(totals, (np.arange(most) + 0.5) / most * totals[-1]))
    return rows.astype(np.intp), roots[rows]


def _log_steps(before: Array, after: Array) -> F64:
    """[n] growth of the mean logarithm of scales [n, 3]; 0 for strokes without extent."""
    is_known = ((before > 0) & (after > 0)).all(axis=1)
    steps = np.zeros(len(before))
    ratios = after[is_known].astype(np.float64) / before[is_known]
    steps[is_known] = np.log(ratios).mean(axis=1)
    return steps


def _sectors(means: Array, first_view: FirstView) -> Rows:
    """[n] part of the scene of each row: sectors around the subject, so that each has all heights."""
    axes = camera_axes(first_view.up, 0.0, 0.0)
    away = (means.astype(np.float64) - first_view.points.mean(axis=0)) @ axes.T
    turns = np.arctan2(away[:, 0], away[:, 2]) / (2 * np.pi) + 0.5
    return np.asarray(np.floor(SECTORS * turns).astype(np.intp) % NUM_FOLDS)


def _color_blocks(colors: F64) -> Rows:
    """[n] part of the color space of each color [n, 3]: clusters, so that held-out colors lie apart."""
    labels = lloyd(colors.astype(np.float32), np.ones(len(colors)), NUM_BLOCKS).labels
    return np.asarray(labels % NUM_FOLDS, np.intp)
