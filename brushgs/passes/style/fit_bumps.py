"""Fit as few bumps over stroke features as explain what an affine map leaves of an edit.

Features, the number of bumps and the ridge are chosen by cross-validation: parts of the scene are held out in
turn, and then parts of the colors. A feature that explains nothing of the held-out strokes is not used, and
if none does there are no bumps. Other scenes have other colors, so bumps are weakened to the share that holds
for held-out colors.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from brushgs.passes.reduce.lloyd import lloyd
from brushgs.passes.style.edit import bumps, within
from brushgs.passes.style.features import COLOR_FEATURES
from brushgs.values.arrays import F32, F64, Mask, Rows
from brushgs.values.style import Residual

# Between scenes and strokes made of them, medians of these differ by at most 0.3 deviations; those of
# elongation, flatness, visibility and contrast by up to 0.9, and more in scenes of discs.
CANDIDATES: tuple[tuple[str, ...], ...] = (
    COLOR_FEATURES,
    COLOR_FEATURES[1:],
    ("lightness",),
    ("height",),
    ("distance",),
    ("level",),
    ("size",),
    ("gloss",),
)
FEW_ROWS = 4000  # for choosing features
NUM_FOLDS = 4
SCREENING = 24  # bumps for comparing features
COUNTS = (8, 24, 64)  # numbers of bumps to try
WIDTHS = (1.0, 2.0)  # widths to try, in root mean square distances to the nearest other bump
HOLDS = (1e-5, 1e-4, 1e-3, 1e-2, 1e-1)  # ridges to try, relative to the moments of a bump
LEAST_GAIN = 0.3  # share of the squared difference that another feature must explain
MORE_GAIN = 0.3  # and that more bumps must
LEAST_EXPLAINED = 0.5  # and that all together must: what explains less means something else in another scene
MOST_FEATURES = 3  # largest number of sets
NOTHING, ENOUGH = 1.5 / 255, 0.5 / 255  # root mean square differences: invisible, and negligible in sum
LEAST_ROWS = 64
CELL = 0.5  # deviations: cells of feature space in which strokes are counted
EVENNESS = 0.5  # exponent of these counts that weights are divided by, because other scenes have other colors


@dataclass(frozen=True, eq=False)
class Samples:
    """Strokes, and what remains to be explained of each.

    Attributes:
        rgb: [n, 3] colors before.
        values: [n, F] features, see `names`.
        names: of the features.
        wanted: [n, C] residual of the affine map: RGB, then log size if it varies.
        weights: [n, C] of each, >= 0.
        folds: [2, n] 0 to `NUM_FOLDS` - 1: by parts of the scene, and by parts of the colors.
    """

    rgb: F64
    values: F64
    names: tuple[str, ...]
    wanted: F64
    weights: F64
    folds: Rows

    def take(self, rows: Rows) -> "Samples":
        """Some of them."""
        return replace(
            self,
            rgb=self.rgb[rows],
            values=self.values[rows],
            wanted=self.wanted[rows],
            weights=self.weights[rows],
            folds=self.folds[:, rows],
        )


@dataclass(frozen=True, eq=False)
class BumpFit:
    """Bumps, and what they explain.

    Attributes:
        residual: the bumps; None if nothing is gained.
        before: root mean square of the wanted outputs.
        held_out: root mean square of what remains in held-out parts of the scene.
        kept: 0 to 1, the share of the best bumps in them.
    """

    residual: Residual | None
    before: float
    held_out: float
    kept: float = 1.0


def fit_bumps(samples: Samples, candidates: Sequence[tuple[str, ...]], *, most: int | None = None) -> BumpFit:
    """Fit bumps, or none.

    Args:
        samples: n strokes.
        candidates: sets of features that are added together.
        most: largest number of bumps; None for the largest of `COUNTS`, 0 for none.
    """
    start = _root_mean(samples, samples.wanted)
    if len(samples.rgb) < LEAST_ROWS or start < NOTHING or most == 0:
        return BumpFit(None, start, start)
    few = samples.take(np.arange(0, len(samples.rgb), -(-len(samples.rgb) // FEW_ROWS)))
    chosen, error = _choose_features(few, candidates, _root_mean(few, few.wanted) ** 2, most or SCREENING)
    if not chosen:
        return BumpFit(None, start, start)
    best, error = None, np.inf
    for count in sorted({min(count, most or count) for count in COUNTS}):
        trials = [_tried(samples, chosen, count, width) for width in WIDTHS]
        trial, found = min(trials, key=lambda tried: tried[1])
        if best is None or found < (1 - MORE_GAIN) * error:
            best, error = trial, found
        if error < ENOUGH**2:
            break
    if best is None or error > (1 - LEAST_EXPLAINED) * start**2:
        return BumpFit(None, start, start)
    return BumpFit(_fitted(samples, best), start, float(np.sqrt(error)), best.kept)


def _choose_features(
    few: Samples, candidates: Sequence[tuple[str, ...]], error: float, most: int
) -> tuple[tuple[str, ...], float]:
    """Forward selection: repeatedly add the set that explains most of the held-out strokes."""
    chosen: tuple[str, ...] = ()
    for _ in range(MOST_FEATURES):
        trials = [
            (
                min(_tried(few, chosen + more, min(SCREENING, most), width)[1] for width in WIDTHS),
                chosen + more,
            )
            for more in candidates
            if not set(more) & set(chosen)
        ]
        found, names = min(trials, default=(np.inf, chosen))
        if not found < (1 - LEAST_GAIN) * error:
            break
        chosen, error = names, found
        if error < NOTHING**2:
            break
    return chosen, error


@dataclass(frozen=True, eq=False)
class _Trial:
    """Bumps without weights."""

    names: tuple[str, ...]
    centers: F32
    width: float
    offset: F64
    scale: F64
    hold: float = 0.0
    kept: float = 1.0

    def place(self, samples: Samples) -> F64:
        """[n, F] the features in standard deviations."""
        chosen = [samples.names.index(name) for name in self.names]
        return within(self.names, self.centers, (samples.values[:, chosen] - self.offset) / self.scale)

    def columns(self, samples: Samples) -> F64:
        """[n, 4 K] columns of the bumps' weights: each bump times color and 1."""
        heights = bumps(self.centers, self.width, self.place(samples))
        basis = np.column_stack([samples.rgb - 0.5, np.ones(len(heights))])
        return (heights[:, :, None] * basis[:, None]).reshape(len(heights), -1)


def _tried(samples: Samples, names: tuple[str, ...], count: int, width: float) -> tuple[_Trial, float]:
    """Bumps over some features with the best ridge, and the mean square that they leave when held out."""
    chosen = samples.values[:, [samples.names.index(name) for name in names]]
    shares = samples.weights.mean(axis=1) / samples.weights.mean(axis=1).sum()
    offset = shares @ chosen
    scale = np.sqrt(shares @ (chosen - offset) ** 2)
    scale = np.where(scale > 1e-6, scale, 1.0)
    place = (chosen - offset) / scale
    centers = _centers(place, count)
    trial = _Trial(names, centers, width * _spacing(centers), offset, scale)
    columns, even = trial.columns(samples), _evened(samples.weights, place)
    # [ridge, kind of folds, evened or plain weights]: squares of wanted values, their products with
    # predictions, squares of predictions.
    sums = np.zeros((len(HOLDS), 2, 2, 3))
    for kind, folds in enumerate(samples.folds):
        moments = [_moments(columns, samples.wanted, even, folds == fold) for fold in range(NUM_FOLDS)]
        whole = [_Moments.sum_of(parts) for parts in zip(*moments, strict=True)]
        for fold, parts in enumerate(moments):
            out = folds == fold
            wanted = samples.wanted[out]
            for number, hold in enumerate(HOLDS):
                predicted = columns[out] @ _solved(whole, hold, parts)
                for way, weights in enumerate((even[out], samples.weights[out])):
                    products = (wanted**2, wanted * predicted, predicted**2)
                    sums[number, kind, way] += [(weights * some).sum() for some in products]
    best = int(np.argmin(sums[:, :, 0].sum(axis=1) @ (1, -2, 1)))
    _, gained, moved = sums[best, 1, 0]
    kept = min(max(gained / moved, 0.0), 1.0) if moved > 0 else 1.0
    left = float(sums[best, 0, 1] @ (1, -2 * kept, kept**2))
    return replace(trial, hold=HOLDS[best], kept=kept), left / float(samples.weights[:, :3].sum())


def _fitted(samples: Samples, trial: _Trial) -> Residual:
    """The bumps with their weights, fitted to all strokes."""
    even = _evened(samples.weights, trial.place(samples))
    whole = _moments(trial.columns(samples), samples.wanted, even, np.ones(len(even), dtype=bool))
    found = trial.kept * _solved(whole, trial.hold)  # [4 K, C]
    maps = found.reshape(-1, 4, found.shape[1]).transpose(0, 2, 1)  # [K, C, 4]
    slopes = maps[:, :3, :3]
    weights = maps[:, :, 3].copy()
    weights[:, :3] -= 0.5 * slopes.sum(axis=2)
    single = np.float32
    return Residual(
        trial.names,
        trial.centers,
        trial.width,
        weights.astype(single),
        trial.offset.astype(single),
        trial.scale.astype(single),
        slopes.astype(single),
    )


@dataclass(frozen=True, eq=False)
class _Moments:
    """Mean products of columns with each other and with the outputs that share their weights.

    Attributes:
        columns: [P] columns in use: for a log size, which has no color, only those of the bumps alone.
        outputs: [c].
        gram: [P, P].
        right: [P, c].
    """

    columns: Rows
    outputs: Rows
    gram: F64
    right: F64

    @staticmethod
    def sum_of(parts: "Sequence[_Moments]") -> "_Moments":
        """The moments of several parts of a scene together."""
        gram, right = (np.sum([getattr(part, name) for part in parts], axis=0) for name in ("gram", "right"))
        return replace(parts[0], gram=gram, right=right)


def _moments(columns: F64, wanted: F64, weights: F64, rows: Mask) -> list[_Moments]:
    """The moments of some strokes, for all outputs."""
    is_same = bool((weights[:, :3] == weights[:, :1]).all())
    columns, wanted, weights = columns[rows], wanted[rows], weights[rows]
    groups = [np.arange(3)] if is_same else [np.array([channel]) for channel in range(3)]
    found = []
    for outputs in [*groups, *([np.array([3])] if wanted.shape[1] > 3 else [])]:
        some = np.arange(columns.shape[1]) if outputs[0] < 3 else np.arange(3, columns.shape[1], 4)
        weighted = columns[:, some] * weights[:, outputs[0], None]
        found.append(_Moments(some, outputs, weighted.T @ columns[:, some], weighted.T @ wanted[:, outputs]))
    return found


def _solved(whole: list[_Moments], hold: float, without: list[_Moments] | None = None) -> F64:
    """[4 K, C] ridge regression on all strokes, or on all but a part."""
    found = np.zeros((len(whole[0].columns), sum(len(part.outputs) for part in whole)))
    for number, part in enumerate(whole):
        gram, right = part.gram, part.right
        if without is not None:
            gram, right = gram - without[number].gram, right - without[number].right
        held = hold * max(float(np.trace(gram)) / len(gram), np.finfo(np.float64).tiny)
        solved = np.linalg.solve(gram + held * np.eye(len(gram)), right)
        found[np.ix_(part.columns, part.outputs)] = solved
    return found


def _evened(weights: F64, place: F64) -> F64:
    """Weights [n, C] of strokes at places [n, F], with rare ones weighted up."""
    _, cell_of = np.unique(np.rint(place / CELL).astype(np.int32), axis=0, return_inverse=True)
    cell_of = cell_of.reshape(-1)
    totals = np.bincount(cell_of, weights.mean(axis=1))
    totals = np.maximum(totals, 1e-6 * totals.max()) ** EVENNESS
    return np.asarray(weights / totals[cell_of, None])


def _centers(place: F64, count: int) -> F32:
    """[K, F] k-means centers of the places; fewer if there are fewer distinct places."""
    fine = CELL / 4 if place.shape[1] > 1 else CELL / 32
    points = (fine * np.unique(np.rint(place / fine), axis=0)).astype(np.float32)
    points = points[:: -(-len(points) // FEW_ROWS)]
    if len(points) <= count:
        return points
    padded = np.zeros((len(points), max(3, points.shape[1])), np.float32)
    padded[:, : points.shape[1]] = points
    labels = lloyd(padded, np.ones(len(points)), count).labels
    sizes = np.bincount(labels)
    sums = [np.bincount(labels, points[:, column]) for column in range(points.shape[1])]
    return np.stack([total / sizes for total in sums], axis=1).astype(np.float32)


def _spacing(centers: F32) -> float:
    """Root mean square distance of each center to the nearest other; 1 for a single one."""
    if len(centers) < 2:
        return 1.0
    squares = ((centers[:, None].astype(np.float64) - centers) ** 2).sum(axis=2)
    np.fill_diagonal(squares, np.inf)
    return float(np.sqrt(squares.min(axis=1).mean()))


def _root_mean(samples: Samples, values: F64) -> float:
    """Root mean square of values [n, C] over strokes and color channels."""
    total = samples.weights[:, :3].sum()
    return float(np.sqrt((samples.weights * values**2).sum() / total)) if total > 0 else 0.0
