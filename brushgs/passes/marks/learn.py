"""Learn the changes by marks to the strokes below them, and apply them to similar strokes.

    painted strokes -> features -> ridge regression of the changes -> strokes with similar features

Features and kernel (bumps) are those of edit styles, with one bump per painted stroke. Learned changes are
weighted by the similarity of a stroke to painted ones.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from brushgs.passes.form.planes import Planes, pairs_of, unit_pairs
from brushgs.passes.marks.changes import turned
from brushgs.passes.marks.strokes import SIGMAS
from brushgs.passes.style.edit import ROWS_AT_A_TIME, bumps, resized
from brushgs.passes.style.features import stroke_features
from brushgs.passes.style.learn_edit import sampled
from brushgs.values.arrays import F64, Rows, smoothstep
from brushgs.values.camera import FirstView
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.gaussians import Gaussians
from brushgs.values.marks import NO_TILE, Marks
from brushgs.values.sh import base_colors, shift_base_colors

# Feature -> difference from which strokes may be painted differently.
WIDTHS = {
    "lightness": 0.15,
    "green_red": 0.08,
    "blue_yellow": 0.08,
    "size": 0.5,
    "level": 0.35,
    "height": 0.3,
    "distance": 0.4,
}
BUMP = 1.5  # width of the bumps of the regression, in units of `WIDTHS`
# Shares of paint on similar strokes at which a change has weight 1 and 0, relative to the median share on
# painted strokes: strokes that a mark touches by accident are a small share of their kind.
LIKE, UNLIKE = 0.3, 0.1
NEAR = 8  # painted strokes that must be near; see `reach`
MOST, NEXT, FAR = (
    0.75,
    0.8,
    1.75,
)  # quantile of the distances, minimum reach in widths, and factor of the reach at which the weight is 0
AGREED = 0.4  # length of a pair from which a direction has weight 1; shorter ones are means of different ones
EDGE_ON = 0.1  # minimum weight of a direction within a plane; below it the direction is normal to it
RIDGES = (0.01, 0.1, 1.0, 10.0)
MOST_ROWS = 1000  # maximum number of painted strokes for learning
PAINT = 0.5  # alpha from which a texel counts in the extent of a mark
FAINT = 0.02  # share of paint below which a stroke counts as bare
SMALLEST, LARGEST = np.log(0.7), np.log(2.0)  # changes of log size, so that strokes keep covering
SIZES = 0.3  # weight of a log size relative to a direction
ELONGATED = 0.05  # minimum share of weights with a direction and a size for these to be learned


@dataclass(frozen=True, eq=False)
class Covered:
    """Changes by marks to the n strokes that they cover.

    Attributes:
        rows: [n] of the strokes.
        paint: [n] covered share of each, 0 to 1.
        colors: [n, 3] RGB of the strokes with the paint over them.
        tensors: [n, 3, 3] weighted sums of outer products of directions of the marks.
        log_sizes: [n] logarithms of the widths of marks relative to those of the strokes.
        says: [n] weights of directions and sizes: 0 for round marks.
    """

    rows: Rows
    paint: F64
    colors: F64
    tensors: F64
    log_sizes: F64
    says: F64


def covered(strokes: Gaussians, marks: Marks) -> Covered:
    """Find the strokes whose centers lie below a mark; for a mark over no center, the nearest stroke.

    Args:
        strokes: of the scene.
        marks: painted over them, in order.
    """
    count = len(strokes)
    colors, bare, says = base_colors(strokes.sh), np.ones(count), np.zeros(count)
    tensors, sizes = np.zeros((count, 3, 3)), np.zeros(count)
    means = strokes.means.astype(np.float64)
    widths = 2 * SIGMAS * np.sort(strokes.scales.astype(np.float64), axis=1)[:, 1]
    widths = np.maximum(widths, np.finfo(np.float32).tiny)
    tree = cKDTree(means) if count else None
    for mark in range(len(marks) if count else 0):
        assert tree is not None
        rows, paint, rgb = _below(marks, mark, means, widths, tree)
        colors[rows] += paint[:, None] * (rgb - colors[rows])
        bare[rows] *= 1 - paint
        length, width = _extent(marks, mark)
        weight = paint * max(1 - width / length, 0.0)
        tensors[rows] += weight[:, None, None] * np.outer(marks.directions[mark], marks.directions[mark])
        sizes[rows] += weight * np.log(width / widths[rows])
        says[rows] += weight
    rows = np.flatnonzero(bare < 1 - FAINT)
    log_sizes = np.divide(sizes, says, out=np.zeros(count), where=says > 0)
    return Covered(rows, 1 - bare[rows], colors[rows], tensors[rows], log_sizes[rows], says[rows])


def _extent(marks: Marks, mark: int) -> tuple[float, float]:
    """Length and width of the paint of a mark, without the empty margin of its tile."""
    length, width = float(marks.lengths[mark]), float(marks.widths[mark])
    if marks.tiles[mark] == NO_TILE:
        return length, width
    alpha = marks.images[marks.tiles[mark]][..., 3] / 255.0
    across, along = (np.count_nonzero(alpha.max(axis=axis) > PAINT) for axis in (1, 0))
    if across == 0 or along == 0:
        return length, width
    total = float(alpha.sum())
    return length * total / (alpha.shape[1] * across), width * total / (alpha.shape[0] * along)


def _below(marks: Marks, mark: int, means: F64, widths: F64, tree: cKDTree) -> tuple[Rows, F64, F64]:
    """Strokes below a mark, with the alpha [k] and the colors [k, 3] of its paint there."""
    half = np.array([marks.lengths[mark], marks.widths[mark]]) / 2
    near = np.array(tree.query_ball_point(marks.means[mark], 2 * np.hypot(*half)), np.intp)
    offsets = means[near] - marks.means[mark]
    across = np.cross(marks.directions[mark], marks.normals[mark])
    places = np.stack([offsets @ marks.directions[mark], offsets @ across], axis=1) / half
    deep = np.abs(offsets @ marks.normals[mark]) <= np.maximum(half[1], widths[near])
    inside = deep & (np.abs(places) <= 1).all(axis=1)
    if not inside.any() and deep.any():
        nearest = int(np.argmin(np.where(deep, np.linalg.norm(offsets, axis=1), np.inf)))
        return near[[nearest]], marks.opacities[[mark]], marks.colors[[mark]]
    rows, places = near[inside], places[inside]
    opacity, tile = marks.opacities[mark], marks.tiles[mark]
    if tile == NO_TILE:
        return rows, np.full(len(rows), opacity), np.tile(marks.colors[mark], (len(rows), 1))
    image = marks.images[tile]
    x, y = ((places + 1) / 2 * (image.shape[1], image.shape[0])).astype(np.intp).T
    texels = image[np.minimum(y, image.shape[0] - 1), np.minimum(x, image.shape[1] - 1)] / 255.0
    return rows, opacity * texels[:, 3], texels[:, :3]


@dataclass(frozen=True, eq=False)
class Continuation:
    """Changes learned from n painted strokes.

    Attributes:
        first_view: of the scene, for the features.
        places: [n, F] features of the painted strokes, divided by `WIDTHS`.
        painted: features of strokes with paint [p, F], and the number of strokes that each represents [p].
        all: the same for all strokes.
        colors: regression of changes in OKLab [3].
        shapes: regression of log sizes and directions [1 + D]: pairs relative to the long axes of strokes, or
            tensors in space; None if no direction was learned.
        in_space: whether directions are tensors.
    """

    first_view: FirstView
    places: F64
    painted: tuple[F64, F64]
    all: tuple[F64, F64]
    colors: "_Ridge"
    shapes: "_Ridge | None"
    in_space: bool

    def __call__(self, strokes: Gaussians) -> tuple[Gaussians, int]:
        """The strokes, changed by their similarity to painted ones, and the number of changed ones."""
        found = np.zeros((len(strokes), 6))  # changes of color and log size, and a pair, times the likeness
        places, planes = _places(strokes, self.first_view), _planes(strokes, self.first_view)
        for first in range(0, len(strokes), ROWS_AT_A_TIME):
            some = slice(first, first + ROWS_AT_A_TIME)
            like = self._likeness(places[some])[:, None]
            kernel = bumps(self.places, BUMP, places[some])
            found[some, :3] = like * self.colors(kernel)
            if self.shapes is not None:
                shapes = self.shapes(kernel)
                pairs = _pairs(shapes[:, 1:], planes.take(some), in_space=self.in_space)
                units, agreements = unit_pairs(pairs)
                found[some, 3:4] = like * np.clip(shapes[:, :1] / SIZES, SMALLEST, LARGEST)
                found[some, 4:] = like * units * np.minimum(agreements / AGREED, 1)[:, None]
        changed = (found != 0).any(axis=1)
        if not changed.any():
            return strokes, 0
        pairs = found[:, 4:]
        own = 1 - np.hypot(*pairs.T)  # own direction, weighted by what the learned one leaves
        angles = np.where(pairs.any(axis=1), 0.5 * np.arctan2(pairs[:, 1], own + pairs[:, 0]), 0.0)
        rgb = base_colors(strokes.sh)
        steps = np.clip(rgb_of_oklab(oklab_of(rgb) + found[:, :3]), 0, 1) - rgb
        colored = shift_base_colors(strokes, np.where(changed[:, None], steps, 0))
        sh = np.where(changed[:, None, None], colored.sh, strokes.sh)
        after = resized(turned(replace(strokes, sh=sh), planes.axes[:, 2], angles), found[:, 3])
        return after, int(np.count_nonzero(changed))

    @cached_property
    def reach(self) -> float:
        """Distance within which most painted strokes have `NEAR` others, at least `NEXT`."""
        return max(float(np.quantile(self._away(self.painted[0], 1), MOST)), NEXT)

    def _away(self, places: F64, num_own: int) -> F64:
        """Distance to the `NEAR`-th painted stroke [m], after skipping `num_own` (the stroke itself)."""
        near = cKDTree(self.painted[0])
        return np.asarray(near.query(places, k=[min(NEAR + num_own, near.n)])[0][:, 0])

    @cached_property
    def usual(self) -> float:
        """Median share of paint on strokes similar to painted ones."""
        return max(float(np.median(self._shares(self.places))), 1e-12)

    def _shares(self, places: F64) -> F64:
        """Share of paint on strokes similar to these, [m]."""
        painted, total = (bumps(own, 1.0, places) @ counts for own, counts in (self.painted, self.all))
        return np.asarray(painted / np.maximum(total, painted + 1e-12))

    def _likeness(self, places: F64) -> F64:
        """Similarity of strokes to painted ones, 0 to 1, [m]."""
        share = self._shares(places) / self.usual
        reached = 1 - smoothstep((self._away(places, 0) / self.reach - 1) / (FAR - 1))
        return np.asarray(reached * smoothstep((share - UNLIKE) / (LIKE - UNLIKE)))


def learn(strokes: Gaussians, marks: Marks, first_view: FirstView) -> Continuation | None:
    """Learn the changes by marks to strokes; None if no stroke is covered.

    Args:
        strokes: of the scene, without the marks.
        marks: painted over it.
        first_view: of the scene.
    """
    found = covered(strokes, marks)
    if not len(found.rows):
        return None
    some, weights = sampled(found.paint, most=MOST_ROWS)
    rows, says = found.rows[some], weights * found.says[some] / found.paint[some]
    every = _places(strokes, first_view)
    places = every[rows]
    painted = _fewer(every[found.rows], found.paint)
    among = places, painted, _fewer(every, np.ones(len(strokes)))
    kernel = bumps(places, BUMP, places)
    before = oklab_of(base_colors(strokes.sh)[rows])
    colors, _ = _Ridge.of(kernel, oklab_of(found.colors[some]) - before, weights)
    if says.sum() < ELONGATED * weights.sum():
        return Continuation(first_view, *among, colors, None, False)
    one = strokes.take(rows)
    planes = _planes(one, first_view)
    _, vectors = np.linalg.eigh(found.tensors[some])
    pairs = unit_pairs(pairs_of(planes.project(vectors[:, :, 2])))[0]
    best: tuple[float, _Ridge, bool] | None = None
    for in_space in (False, True):
        directions = planes.lift(pairs, np.ones(len(pairs))) if in_space else pairs
        wanted = np.column_stack([SIZES * found.log_sizes[some], directions])
        ridge, without = _Ridge.of(kernel, wanted, says)
        guess = unit_pairs(_pairs(without[:, 1:], planes, in_space=in_space))[0]
        agreement = float(says @ (guess * pairs).sum(axis=1))
        if best is None or agreement > best[0]:
            best = agreement, ridge, in_space
    assert best is not None
    return Continuation(first_view, *among, colors, best[1], best[2])


@dataclass(frozen=True, eq=False)
class _Ridge:
    """Kernel ridge regression around a mean: mean [C] + kernel [m, n] @ weights [n, C]."""

    mean: F64
    weights: F64

    def __call__(self, kernel: F64) -> F64:
        return np.asarray(self.mean + kernel @ self.weights)

    @classmethod
    def of(cls, kernel: F64, wanted: F64, counts: F64) -> "tuple[_Ridge, F64]":
        """Fit values [n, C] with weights [n], and return leave-one-out predictions [n, C] too.

        The ridge is the one of `RIDGES` with the smallest leave-one-out error.
        """
        shares = counts / counts.sum()
        mean = shares @ wanted
        root = np.sqrt(shares * len(shares))[:, None]
        values, vectors = np.linalg.eigh(root * kernel * root.T)
        values, aim = np.maximum(values, 0), root * (wanted - mean)
        best: tuple[float, _Ridge, F64] | None = None
        for ridge in RIDGES:
            shrunk = values / (values + ridge)
            left = aim - vectors @ (shrunk[:, None] * (vectors.T @ aim))
            without = left / np.maximum(1 - (vectors**2) @ shrunk, 1e-6)[:, None]
            error = float((without**2).sum())
            if best is None or error < best[0]:
                weights = root * (vectors @ ((vectors.T @ aim) / (values + ridge)[:, None]))
                predicted = wanted - np.divide(without, root, out=np.zeros_like(aim), where=root > 0)
                best = error, cls(mean, weights), predicted
        assert best is not None
        return best[1], best[2]


def _places(strokes: Gaussians, first_view: FirstView) -> F64:
    """Features divided by `WIDTHS`, [N, F]."""
    widths = np.array([*WIDTHS.values()])
    return np.asarray(stroke_features(strokes, first_view, tuple(WIDTHS)).values / widths)


def _fewer(places: F64, counts: F64) -> tuple[F64, F64]:
    """At most `MOST_ROWS` of the features [N, F], and the number of strokes that each represents."""
    step = -(-len(places) // MOST_ROWS)
    return places[::step], step * counts[::step]


def _planes(strokes: Gaussians, first_view: FirstView) -> Planes:
    """Right-handed planes of strokes, with normals away from the center of the subject.

    Angles to the long axis then have the same sign on neighboring strokes.
    """
    planes = Planes.of(strokes)
    along, normals = planes.axes[:, 0], planes.axes[:, 2]
    outward = np.einsum("ni,ni->n", planes.means - first_view.points.mean(axis=0), normals)
    normals = np.where(outward[:, None] < 0, -normals, normals)
    return replace(planes, axes=np.stack([along, np.cross(normals, along), normals], axis=1))


def _pairs(directions: F64, planes: Planes, *, in_space: bool) -> F64:
    """Directions, given as pairs or as tensors in space, as pairs [m, 2]."""
    if not in_space:
        return directions
    pairs, weights = planes.lower(directions)
    return pairs / np.maximum(weights, EDGE_ON)[:, None]
