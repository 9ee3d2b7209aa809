"""Which way a stroke points in any view, by stroke and view alone: frames painted alone agree.

For one stroke the directions in all views are a field of tangents on the sphere of views, which has singular
views whatever one does. `lock="anchor"` has two, both ends of the longest axis, which lie at views in which
surfaces are seen. Here both are one, at the view from which the stroke is seen least: a vector across
`facing`, `along`, is carried to the view by the shortest turn, and the direction is that of its picture. It
turns by less than a degree for each degree of the view on the half of the sphere that is faced. Then it bends
toward the axis of the ellipse, the more slender the closer.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from brushgs.options.choices import ViewLock
from brushgs.rendering.options import RenderOptions, project_with
from brushgs.rendering.project import Directions
from brushgs.rendering.visibility import visible_areas
from brushgs.values.arrays import F64, Array, Mask
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices

NUM_ALONG = 32  # directions across `facing` that are tried
NUM_BEST = 2  # candidates of `facing` for which they are
MINOR_AXIS = 0.3  # cost of lying along the minor axis of a needle, as of the track
RATE = 0.08  # cost of turning by one degree for each degree of the view
MOST_RATE = 25.0
CALMER = 2.0  # by how much a field must turn less than the longest axis does, to be taken
SOFT = 0.5  # slenderness at which half the way is bent to the axis
TOP = np.radians(60.0)  # off the axis up to which it is bent all that way, and then less: 0 across
NUM_AROUND, AROUND_SIDE, DISTANCE = 40, 72, 2.6  # views from all around: pixels, and radii of the strokes
NEAR = 0.01  # radii, before which nothing is seen
LEAST = 1e-4  # share of the weight of a view that a hidden stroke has
SINGULAR = 1e-4  # of 1 + the cosine of the angle to `facing`: below, the view counts as singular


@dataclass(frozen=True, eq=False)
class Canonical:
    """The field of directions of each stroke.

    Attributes:
        facing: [N, 3] unit vectors, world axes: opposite to the singular view.
        along: [N, 3] unit vectors across these.
        is_anchored: [N] whether a stroke turns less where it follows its longest axis, as "anchor" has it:
            thin things that are seen from all sides.
    """

    facing: F64
    along: F64
    is_anchored: Mask

    def followed_by(self, others: "Canonical") -> "Canonical":
        """The fields of these strokes, then those of others."""
        pairs = ((getattr(self, one.name), getattr(others, one.name)) for one in fields(Canonical))
        return Canonical(*(np.concatenate(pair) for pair in pairs))

    def arrows(self, strokes: Gaussians, camera: Camera) -> F64:
        """[N] radians, the direction in the picture of what each field carries to a view, not bent."""
        vectors = _carried(self.facing, self.along, _views(strokes, camera))
        if self.is_anchored.any():
            vectors = np.where(self.is_anchored[:, None], _own_axes(strokes)[2], vectors)
        return np.nan_to_num(_angles(camera, strokes.means, vectors))

    def turned(self, turn: Callable[[Array], Array]) -> "Canonical":
        """The fields of strokes that are turned; `turn` turns vectors [N, 3] with them."""
        facing, along = (turn(one).astype(np.float64) for one in (self.facing, self.along))
        return replace(self, facing=facing, along=along)

    def directions(
        self,
        strokes: Gaussians,
        camera: Camera,
        options: RenderOptions | None = None,
    ) -> Directions:
        """Which way the strokes point in a view; `options` are those of how they are drawn."""
        axes, slenderness, is_seen = _ellipses(strokes, camera, options)
        carried = _angles(camera, strokes.means, _carried(self.facing, self.along, _views(strokes, camera)))
        found = np.where(is_seen, _bent(carried, axes, slenderness), 0.0)
        if self.is_anchored.any():
            anchored = _ellipses(strokes, camera, options, "anchor")[0]
            found = np.where(self.is_anchored, anchored, found)
        return Directions(_wrapped(found, 2 * np.pi).astype(np.float32))


def directions_of(
    strokes: Gaussians, camera: Camera, options: RenderOptions, fields: "Canonical | None" = None
) -> Directions | None:
    """Which way strokes point that are painted in a view alone; None if they have no lock.

    Strokes outside the picture have the direction 0.
    """
    if fields is not None:
        return fields.directions(strokes, camera, options)
    if options.lock != "anchor":
        return None
    angles = _ellipses(strokes, camera, options, "anchor")[0]
    return Directions(angles.astype(np.float32))


def fit_canonical(strokes: Gaussians, *, num_threads: int | None = None) -> Canonical:
    """Choose the field of each stroke by where it is seen, in views from all around, those from below too.

    Args:
        strokes: N strokes.
        num_threads: None takes the processors available to this process. The result does not depend on it.
    """
    if len(strokes) == 0:
        return Canonical(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, np.bool_))
    cameras = views_around(strokes)
    count, num, options = len(cameras), len(strokes), RenderOptions(num_sigmas=1.0, num_threads=num_threads)
    axes, slenderness, weights, views = (np.zeros((count, num, *more)) for more in ((), (), (), (3,)))
    for k, camera in enumerate(cameras):
        axes[k], slenderness[k], _ = _ellipses(strokes, camera, options)
        weights[k] = visible_areas(strokes, camera, num_threads=num_threads)
        views[k] = _views(strokes, camera)
    weights = weights / np.maximum(weights.sum(axis=0), 1e-9) + LEAST
    candidates = _candidates(strokes, weights, views)
    rates = np.stack([_rates(facing, weights, views) for facing in candidates])
    chosen = np.argsort(rates, axis=0, kind="stable")[:NUM_BEST]
    rows = np.arange(num)
    best, facing, along = np.full(num, np.inf), np.zeros((num, 3)), np.zeros((num, 3))
    of_area = weights * np.minimum(0.5 * np.log1p(0.25 * slenderness), 2)
    of_minor = weights * MINOR_AXIS * slenderness / (slenderness + 4)
    turns = 2 * np.pi * np.arange(NUM_ALONG) / NUM_ALONG
    for one in chosen:
        towards = candidates[one, rows]
        first = _across(towards)
        off = axes - np.stack(
            [
                _angles(camera, strokes.means, _carried(towards, first, seen))
                for camera, seen in zip(cameras, views, strict=True)
            ]
        )
        fourth = (of_area * np.exp(4j * off)).sum(axis=0)
        second = (of_minor * np.exp(2j * off)).sum(axis=0)
        # Turned about `towards`, the picture turns the other way round: y is down.
        costs = (
            -0.5 * np.real(fourth[:, None] * np.exp(4j * turns) + second[:, None] * np.exp(2j * turns))
            + (RATE * rates[one, rows])[:, None]
        )
        at = costs.argmin(axis=1)
        is_better = costs[rows, at] < best
        best = np.where(is_better, costs[rows, at], best)
        turn = turns[at][:, None]
        vector = np.cos(turn) * first + np.sin(turn) * np.cross(towards, first)
        facing[is_better], along[is_better] = towards[is_better], vector[is_better]
    longest = _own_axes(strokes)[2]
    cosines = np.einsum("nc,knc->kn", longest, views) ** 2
    turns_of_anchor = np.minimum(cosines / np.maximum(1 - cosines, 1e-3), MOST_RATE)
    is_anchored = (weights * turns_of_anchor).sum(axis=0) < CALMER * _rates(facing, weights, views)
    agrees = np.sum(
        weights.T[:, :, None] * _picture_vectors(facing, along, views) * longest[:, None], axis=(1, 2)
    )
    return Canonical(facing, along * np.where(agrees < 0, -1, 1)[:, None], is_anchored)


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


def _picture_vectors(facing: F64, along: F64, views: F64) -> F64:
    """[N, K, 3] the carried vectors in each view."""
    return np.stack([_carried(facing, along, seen) for seen in views], axis=1)


def _ellipses(
    strokes: Gaussians, camera: Camera, options: RenderOptions | None, lock: ViewLock = "off"
) -> tuple[F64, F64, Mask]:
    """[N] the direction of each ellipse, how slender it is, and whether it has a box."""
    options = RenderOptions(num_sigmas=1.0) if options is None else options
    plain = replace(strokes, sh=strokes.sh[:, :1])  # colors do not matter
    flat = replace(options, lock=lock, order="depth", fade=False, underpaint=None, relief=None)
    boxes, _ = project_with(plain, camera, flat)
    angles, slenderness, is_seen = (
        np.zeros(len(strokes)),
        np.zeros(len(strokes)),
        np.zeros(len(strokes), bool),
    )
    half = boxes.half_extents.astype(np.float64)
    ratio = half[:, 0] / np.maximum(half[:, 1], 1e-9)
    angles[boxes.ids], slenderness[boxes.ids] = boxes.angles, np.minimum((ratio - 1 / ratio) ** 2, 1e6)
    is_seen[boxes.ids] = True
    return angles, slenderness, is_seen


def _views(strokes: Gaussians, camera: Camera) -> F64:
    """[N, 3] unit vectors from strokes to the camera."""
    return _unit(camera.position - strokes.means.astype(np.float64))


def _carried(facing: F64, along: F64, views: F64) -> F64:
    """`along` turned as `facing` turns to the view by the shortest way."""
    axis = np.cross(facing, views)
    cosine = np.einsum("nc,nc->n", facing, views)
    first = np.cross(axis, along)
    return np.asarray(along + first + np.cross(axis, first) / np.maximum(1 + cosine, SINGULAR)[:, None])


def _angles(camera: Camera, means: Array, vectors: F64) -> F64:
    """[N] the direction in the picture of vectors at points."""
    turn = camera.viewmat[:3, :3]
    at = means.astype(np.float64) @ turn.T + camera.viewmat[:3, 3]
    moved = vectors @ turn.T
    slopes = at[:, :2] / np.maximum(at[:, 2:], 1e-6)
    pixels = (moved[:, :2] - slopes * moved[:, 2:]) * np.diag(camera.K)[:2]
    return np.arctan2(pixels[:, 1], pixels[:, 0])


def _bent(angles: F64, axes: F64, slenderness: F64) -> F64:
    """Directions bent toward the axes of their ellipses."""
    off = _wrapped(axes - angles, np.pi)
    size = np.abs(off)
    bend = np.where(size < TOP, size, (np.pi / 2 - size) * (TOP / (np.pi / 2 - TOP)))
    return np.asarray(angles + slenderness / (slenderness + SOFT) * bend * np.sign(off))


def _candidates(strokes: Gaussians, weights: F64, views: F64) -> F64:
    """[C, N, 3] unit vectors that `facing` may be."""
    shortest, middle, longest = _own_axes(strokes)
    best_seen = _unit(np.einsum("kn,knc->nc", weights, views))
    radial = _unit(strokes.means - np.median(strokes.means.astype(np.float64), axis=0))
    found = [best_seen, shortest, -shortest, radial, middle, -middle, longest, -longest]
    found += [_unit(best_seen + shortest), _unit(best_seen - shortest), _unit(best_seen + radial)]
    found = [np.where(np.abs(one).sum(axis=1, keepdims=True) > 0, one, shortest) for one in found]
    return np.stack([*found, *(np.broadcast_to(one, shortest.shape) for one in _sphere(16))])


def _rates(facing: F64, weights: F64, views: F64) -> F64:
    """[N] degrees by which a direction turns for one of the view, where strokes are seen."""
    cosines = np.einsum("nc,knc->kn", facing, views)
    rates = np.minimum((1 - cosines) / np.maximum(1 + cosines, 1e-3), MOST_RATE)
    return np.asarray((weights * rates).sum(axis=0))


def _own_axes(strokes: Gaussians) -> tuple[F64, F64, F64]:
    """[N, 3] the shortest, the middle and the longest axis of each stroke."""
    axes, order = rotation_matrices(strokes.quats.astype(np.float64)), np.argsort(strokes.scales, axis=1)
    rows = np.arange(len(strokes))
    return axes[rows, :, order[:, 0]], axes[rows, :, order[:, 1]], axes[rows, :, order[:, 2]]


def _across(vectors: F64) -> F64:
    """Unit vectors across others."""
    helper = np.where(np.abs(vectors[:, :1]) < 0.7, [[1.0, 0, 0]], [[0, 1.0, 0]])
    return _unit(np.cross(vectors, helper))


def _sphere(count: int) -> F64:
    """[count, 3] points spread evenly on the unit sphere."""
    z = 1 - (2 * np.arange(count) + 1) / count
    turn = np.pi * (3 - np.sqrt(5)) * np.arange(count)
    side = np.sqrt(1 - z**2)
    return np.stack([side * np.cos(turn), side * np.sin(turn), z], axis=1)


def _unit(vectors: Array) -> F64:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, 1e-12), np.float64)


def _wrapped(angles: F64, period: float) -> F64:
    return np.asarray((angles + period / 2) % period - period / 2)
