"""Direction of strokes as a function of stroke and view alone, so that independently rendered frames agree.

The directions of a stroke over all views form a tangent field on the sphere of views, which must have
singular views. `lock="anchor"` has two, at the ends of the longest axis, from which surfaces are visible.
Here both coincide at the view from which the stroke is least visible: the vector `along`, perpendicular to
`facing`, is rotated with `facing` to the view by the shortest rotation, and projected. On the hemisphere
around `facing` it turns by less than a degree per degree of the view. Finally it is bent toward the axis of
the ellipse, the more so the more slender the ellipse.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields, replace

import numpy as np

from brushgs.brushes.texture import StrokeTexture
from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.options.choices import ViewLock
from brushgs.rendering.options import RenderOptions, project_with
from brushgs.rendering.project import Directions
from brushgs.rendering.view_by_view import view_by_view
from brushgs.rendering.visibility import painted_shares
from brushgs.values.arrays import F64, Array, Mask
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices

NUM_ALONG = 32  # candidates of `along` for each `facing`
NUM_BEST = 2  # best candidates of `facing` for which `along` is searched
MINOR_AXIS = 0.3  # cost of lying along the minor axis of a needle, as in tracking
RATE = 0.08  # cost of turning by one degree per degree of the view
MOST_RATE = 25.0
CALMER = 2.5  # factor by which the rate of the longest axis must exceed that of a field, for the field
SOFT = 0.5  # slenderness at which a direction is bent half of the way to the axis
NUM_AROUND, AROUND_SIDE, DISTANCE = 40, 72, 2.6  # views around: number, side in pixels, distance in radii
NEAR = 0.01  # near plane, in radii
LEAST = 1e-4  # least weight of a view, relative to the total
CHUNK = 1024  # strokes fitted at once, few enough for the cache
SINGULAR = 1e-4  # least value of 1 + the cosine of the angle to `facing`; below, the view is singular


@dataclass(frozen=True, eq=False)
class Canonical:
    """The field of directions of each stroke.

    Attributes:
        facing: [N, 3] unit vectors, world axes: opposite to the singular view.
        along: [N, 3] unit vectors perpendicular to these.
        is_anchored: [N] strokes that follow their longest axis, as with "anchor", because they then turn
            less: thin objects that are visible from all sides.
    """

    facing: F64
    along: F64
    is_anchored: Mask

    def followed_by(self, others: "Canonical") -> "Canonical":
        """Concatenate, with the fields of `others` last."""
        pairs = ((getattr(self, one.name), getattr(others, one.name)) for one in fields(Canonical))
        return Canonical(*(np.concatenate(pair) for pair in pairs))

    def arrows(self, strokes: Gaussians, camera: Camera) -> F64:
        """[N] directions in the picture of a view, radians, before bending."""
        frame = _Views.of(strokes, camera)
        x, y = frame.carried(self.facing.T, self.along.T)
        if self.is_anchored.any():
            x, y = np.where(self.is_anchored, frame.pictured(_own_axes(strokes)[2].T), (x, y))
        return np.nan_to_num(np.arctan2(y, x))

    def turned(self, turn: Callable[[Array], Array]) -> "Canonical":
        """The fields of rotated strokes; `turn` rotates vectors [N, 3] with them."""
        facing, along = (turn(one).astype(np.float64) for one in (self.facing, self.along))
        return replace(self, facing=facing, along=along)

    def directions(
        self,
        strokes: Gaussians,
        camera: Camera,
        options: RenderOptions | None = None,
    ) -> Directions:
        """The directions of the strokes in a view, drawn with `options`; 0 outside the picture."""
        axes, slenderness, is_seen = _ellipses(strokes, camera, options)
        x, y = _Views.of(strokes, camera).carried(self.facing.T, self.along.T)
        found = np.where(is_seen, _bent(np.arctan2(y, x), axes, slenderness), 0.0)
        if self.is_anchored.any():
            anchored = _ellipses(strokes, camera, options, "anchor")[0]
            found = np.where(self.is_anchored, anchored, found)
        return Directions(_wrapped(found, 2 * np.pi).astype(np.float32))


def directions_of(
    strokes: Gaussians, camera: Camera, options: RenderOptions, fields: "Canonical | None" = None
) -> Directions | None:
    """Directions of strokes in a view rendered on its own; None if they have no lock.

    Strokes outside the picture have the direction 0.
    """
    if fields is not None:
        return fields.directions(strokes, camera, options)
    if options.lock != "anchor":
        return None
    angles = _ellipses(strokes, camera, options, "anchor")[0]
    return Directions(angles.astype(np.float32))


def fit_canonical(strokes: Gaussians, *, num_threads: int | None = None) -> Canonical:
    """Choose the field of each stroke by its visibility in views from all around, including from below.

    Args:
        strokes: N strokes.
        num_threads: None takes the processors available to this process. The result does not depend on it.
    """
    if len(strokes) == 0:
        return Canonical(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, np.bool_))
    looks = _Looks.around(strokes, num_threads)
    starts = range(0, len(strokes), CHUNK)
    with ThreadPoolExecutor(num_threads_or_default(num_threads)) as pool:
        parts = pool.map(lambda at: _fitted(looks.of(slice(at, at + CHUNK))), starts)
        facing, along, is_anchored = (np.concatenate(one) for one in zip(*parts, strict=True))
    return Canonical(facing, along, is_anchored)


def views_around(strokes: Gaussians) -> list[Camera]:
    """Small cameras on a sphere around strokes, at least one."""
    means = strokes.means.astype(np.float64)
    middle = np.median(means, axis=0)
    size = float(np.median(strokes.scales)) or 1.0
    radius = max(float(np.quantile(np.linalg.norm(means - middle, axis=1), 0.9)), size)
    cameras = []
    for toward in _sphere(NUM_AROUND):
        up = (0.0, -1.0, 0.0) if abs(toward[1]) < 0.95 else (1.0, 0.0, 0.0)
        place = middle + DISTANCE * radius * toward
        side, near = AROUND_SIDE, NEAR * radius
        cameras.append(Camera.look_at(place, middle, up, width=side, height=side, near=near))
    return cameras


@dataclass(frozen=True, eq=False)
class _Views:
    """Projection of vectors at the means of strokes to the pictures of one view, or of K views.

    Attributes:
        toward: [3, N] or [3, K, N] unit vectors from the strokes to the cameras.
        right: the same shape; its dot product with a vector is the x component of the projected vector.
        down: the same for the y component.
    """

    toward: Array
    right: Array
    down: Array

    @classmethod
    def of(cls, strokes: Gaussians, camera: Camera) -> "_Views":
        """The projection of one view."""
        means, turn = strokes.means.T.astype(np.float64), camera.viewmat[:3, :3].astype(np.float64)
        at = turn @ means + camera.viewmat[:3, 3:]
        slopes = at[:2] / np.maximum(at[2], 1e-6)
        sides = (
            focal * (turn[axis][:, None] - slope * turn[2][:, None])
            for axis, slope, focal in zip((0, 1), slopes, np.diag(camera.K), strict=False)
        )
        return cls(_unit(camera.position[:, None] - means, axis=0), *sides)

    def pictured(self, vectors: Array) -> tuple[Array, Array]:
        """Components x and y of projected vectors [3, N]."""
        return _dot(self.right, vectors), _dot(self.down, vectors)

    def carried(self, facing: Array, along: Array) -> tuple[Array, Array]:
        """Components x and y of `along` [3, N] after the shortest rotation of `facing` to `toward`.

        The rotated vector is along - (along . toward) (facing + toward) / (1 + facing . toward); `toward`
        projects to 0.
        """
        cosines = _dot(self.toward, facing)
        part = _dot(self.toward, along) / np.maximum(1 + cosines, SINGULAR)
        x, y = self.pictured(along)
        right, down = self.pictured(facing)
        return x - right * part, y - down * part


@dataclass(frozen=True, eq=False)
class _Looks:
    """Strokes in K views from all around.

    Attributes:
        views: the K projections.
        weights: [K, N] visible area of each stroke in each view, over its sum over views.
        doubled: [K, N] exp(2i angle) of the axes of the ellipses.
        of_area: [K, N] weighted cost of a direction diagonal to both axes.
        of_minor: [K, N] weighted cost of a direction along the minor axis.
        longest: [3, N] the longest axis of each stroke.
        candidates: [C, 3, N] unit vectors, candidates for `facing`.
        rates: [C, N] for each, turn of directions per degree of the view, mean weighted by visibility.
    """

    views: _Views
    weights: Array
    doubled: Array
    of_area: Array
    of_minor: Array
    longest: Array
    candidates: Array
    rates: F64

    @classmethod
    def around(cls, strokes: Gaussians, num_threads: int | None) -> "_Looks":
        """Look at strokes, at least one, from all around."""
        kernel = StrokeTexture.open("gaussian")
        options, ones = RenderOptions.of(kernel), np.ones((AROUND_SIDE, AROUND_SIDE))
        plain, cameras = replace(strokes, sh=strokes.sh[:, :1]), views_around(strokes)  # colors do not matter
        axes, slenderness, weights = np.zeros((3, len(cameras), len(strokes)), np.float32)
        vectors = np.empty((3, 3, len(cameras), len(strokes)), np.float32)

        def look(camera: Camera) -> tuple[Boxes, Array, _Views]:
            boxes, _ = project_with(plain, camera, options)
            return boxes, painted_shares(boxes, kernel, ones), _Views.of(strokes, camera)

        for k, (boxes, shares, seen) in enumerate(view_by_view(look, cameras, len(strokes), num_threads)):
            axes[k, boxes.ids], slenderness[k, boxes.ids] = boxes.angles, _slenderness(boxes)
            weights[k, boxes.ids] = shares
            vectors[:, :, k] = seen.toward, seen.right, seen.down
        weights = weights / np.maximum(weights.sum(axis=0), 1e-9) + np.float32(LEAST)
        views = _Views(*vectors)
        candidates = _candidates(strokes, _unit(np.einsum("kn,ckn->nc", weights, views.toward)))
        rates = np.empty((len(candidates), len(strokes)))
        _core.turn_rates(
            toward=views.toward,
            weights=weights,
            facing=candidates,
            most=MOST_RATE,
            rates=rates,
            num_threads=num_threads_or_default(num_threads),
        )
        return cls(
            views,
            weights,
            np.exp(2j * axes),
            weights * np.minimum(0.5 * np.log1p(0.25 * slenderness), 2),
            weights * MINOR_AXIS * slenderness / (slenderness + 4),
            _own_axes(strokes)[2].T,
            candidates,
            rates,
        )

    def of(self, rows: slice) -> "_Looks":
        """The same for a slice of the strokes."""
        views = _Views(*(getattr(self.views, one.name)[..., rows] for one in fields(_Views)))
        others = (getattr(self, one.name)[..., rows] for one in fields(_Looks) if one.name != "views")
        return _Looks(views, *others)

    def best_along(self, facing: Array) -> tuple[Array, Array]:
        """[N] cost of the best `along` for a `facing` [3, N], and that vector [3, N]."""
        first = _across(facing)
        x, y = self.views.carried(facing, first)
        off = self.doubled * (x - 1j * y) ** 2 / np.maximum(x**2 + y**2, 1e-30)
        second = (self.of_minor * off).sum(axis=0)
        fourth = (self.of_area * off**2).sum(axis=0)
        turns = (2 * np.pi / NUM_ALONG) * np.arange(NUM_ALONG)
        # A rotation about `facing` has the opposite sense in the picture, as y is down.
        waves = np.stack([np.cos(4 * turns), -np.sin(4 * turns), np.cos(2 * turns), -np.sin(2 * turns)])
        costs = -0.5 * np.stack([fourth.real, fourth.imag, second.real, second.imag], axis=1) @ waves
        turn = turns[costs.argmin(axis=1)]
        return costs.min(axis=1), np.cos(turn) * first + np.sin(turn) * np.cross(facing, first, axis=0)


def _fitted(looks: _Looks) -> tuple[F64, F64, Mask]:
    """The attributes of `Canonical` for the strokes of some looks: [n, 3], [n, 3] and [n]."""
    toward, rows = looks.views.toward, np.arange(looks.weights.shape[1])
    best = np.full(len(rows), np.inf)
    facing, along, rate = np.zeros((3, len(rows))), np.zeros((3, len(rows))), np.zeros(len(rows))
    for one in np.argsort(looks.rates, axis=0, kind="stable")[:NUM_BEST]:
        candidate, of_candidate = looks.candidates[one, :, rows].T, looks.rates[one, rows]
        cost, vector = looks.best_along(candidate)
        cost = cost + RATE * of_candidate
        is_better = cost < best
        best, rate = np.where(is_better, (cost, of_candidate), (best, rate))
        facing, along = np.where(is_better, (candidate, vector), (facing, along))
    of_longest = _dot(toward, looks.longest)
    cosines = of_longest**2
    of_anchor = np.minimum(cosines / np.maximum(1 - cosines, 1e-3), MOST_RATE)
    is_anchored = (looks.weights * of_anchor).sum(axis=0) < CALMER * rate
    seen = _dot(toward, facing)
    part = _dot(toward, along) / np.maximum(1 + seen, SINGULAR)
    agrees = _dot(along, looks.longest) - part * (_dot(facing, looks.longest) + of_longest)
    along = np.where((looks.weights * agrees).sum(axis=0) < 0, -along, along)
    return facing.T, along.T, is_anchored


def _ellipses(
    strokes: Gaussians, camera: Camera, options: RenderOptions | None, lock: ViewLock = "off"
) -> tuple[F64, F64, Mask]:
    """[N] direction of each ellipse, its slenderness, and whether it has a box."""
    options = RenderOptions(num_sigmas=1.0) if options is None else options
    plain = replace(strokes, sh=strokes.sh[:, :1])  # colors do not matter
    flat = replace(options, lock=lock, order="depth", fade=False, underpaint=None, relief=None)
    boxes, _ = project_with(plain, camera, flat)
    angles, slenderness, is_seen = (
        np.zeros(len(strokes)),
        np.zeros(len(strokes)),
        np.zeros(len(strokes), bool),
    )
    angles[boxes.ids], slenderness[boxes.ids] = boxes.angles, _slenderness(boxes)
    is_seen[boxes.ids] = True
    return angles, slenderness, is_seen


def _slenderness(boxes: Boxes) -> F64:
    """[M] slenderness of boxes, (r - 1 / r)^2 with r the ratio of the sides; 0 for round ones."""
    half = boxes.half_extents.astype(np.float64)
    ratio = half[:, 0] / np.maximum(half[:, 1], 1e-9)
    return np.minimum((ratio - 1 / ratio) ** 2, 1e6)


def _bent(angles: F64, axes: F64, slenderness: F64) -> F64:
    """Directions bent toward the axes of their ellipses; perpendicular ones are not bent.

    Relative to the unbent directions, they turn no faster than the axes do.
    """
    off = _wrapped(axes - angles, np.pi)
    size = np.abs(off)
    bend = np.minimum(size, np.pi / 2 - size)
    return np.asarray(angles + slenderness / (slenderness + SOFT) * bend * np.sign(off))


def _candidates(strokes: Gaussians, best_seen: F64) -> F64:
    """[C, 3, N] candidates for `facing`; `best_seen` [N, 3] point to the views where strokes are visible."""
    shortest, middle, longest = _own_axes(strokes)
    radial = _unit(strokes.means - np.median(strokes.means.astype(np.float64), axis=0))
    found = [best_seen, shortest, -shortest, radial, middle, -middle, longest, -longest]
    found += [_unit(best_seen + shortest), _unit(best_seen - shortest), _unit(best_seen + radial)]
    found = [np.where(np.abs(one).sum(axis=1, keepdims=True) > 0, one, shortest) for one in found]
    found += [np.broadcast_to(one, shortest.shape) for one in _sphere(16)]
    return np.stack([one.T for one in found])


def _own_axes(strokes: Gaussians) -> tuple[F64, F64, F64]:
    """[N, 3] the shortest, the middle and the longest axis of each stroke."""
    axes, order = rotation_matrices(strokes.quats.astype(np.float64)), np.argsort(strokes.scales, axis=1)
    rows = np.arange(len(strokes))
    return axes[rows, :, order[:, 0]], axes[rows, :, order[:, 1]], axes[rows, :, order[:, 2]]


def _across(vectors: Array) -> F64:
    """Unit vectors [3, N] perpendicular to others."""
    helper = np.where(np.abs(vectors[0]) < 0.7, [[1.0], [0.0], [0.0]], [[0.0], [1.0], [0.0]])
    return _unit(np.cross(vectors, helper, axis=0), axis=0)


def _dot(first: Array, second: Array) -> Array:
    """Dot products [N] or [K, N] of vectors along the first axis."""
    return np.asarray(first[0] * second[0] + first[1] * second[1] + first[2] * second[2])


def _sphere(count: int) -> F64:
    """[count, 3] points spread evenly on the unit sphere."""
    z = 1 - (2 * np.arange(count) + 1) / count
    turn = np.pi * (3 - np.sqrt(5)) * np.arange(count)
    side = np.sqrt(1 - z**2)
    return np.stack([side * np.cos(turn), side * np.sin(turn), z], axis=1)


def _unit(vectors: Array, axis: int = -1) -> F64:
    length = np.linalg.norm(vectors, axis=axis, keepdims=True)
    return np.asarray(vectors / np.maximum(length, 1e-12), np.float64)


def _wrapped(angles: F64, period: float) -> F64:
    return np.asarray((angles + period / 2) % period - period / 2)
