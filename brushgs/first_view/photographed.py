"""The first view of a scene from where it was photographed: cameras -> do they fit? -> up -> first view.

Files of cameras lie beside scenes that are not theirs, and beside scenes that were turned, moved or cropped
since. So cameras are taken only where they fit what is seen: they look at the subject, meet in its middle,
agree on which way is up, not against a scene that shows it clearly, and their picture is as full as those
from around the subject. Of 13 real scenes, each beside the cameras of 7 captures, the 4 pairs that belong
together fit, and 1 of 87 others, a fragment of 1,000 Gaussians. A scene that was turned about its up axis is
not told from one that was not.
"""

from dataclasses import dataclass, replace

import numpy as np

from brushgs.cameras.around import ring_views
from brushgs.cameras.first_view import up_text
from brushgs.cameras.framing import AXES, NEAR_SHARE, camera_axes, default_elevation, subject
from brushgs.cameras.ground import level_up
from brushgs.first_view import find_first_view, rank_ups
from brushgs.first_view.sample import Painter, thin
from brushgs.values.arrays import F64, Mask
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians

FEWEST = 3  # cameras: fewer are views that someone kept, and do not tell which way is up
SEE_MIDDLE = 0.8  # share of the cameras in whose picture the middle of the subject is
OFF_MIDDLE = 0.3  # radii of the subject to where the axes meet: of cameras of their own scene up to 0.15
HELD = 0.02  # pull towards the middle where axes are parallel, and meet nowhere
ROUNDS = 20  # of least squares, in which cameras that are rolled lose their weight
LEAST_ROLL = 1e-3  # radians that rounding may bring
MOST_ROLL = np.radians(15.0)  # median of the cameras: more, and they do not say which way is up
WIDE = 0.03  # variance of right axes: below, all cameras stand on one side, and only their mean is known
AGREEING = 0.5  # length of the mean of their up axes from which that one is taken
NEAR_AXIS = np.radians(30.0)  # from that mean to an axis of the scene, which then is up: people tilt cameras
SAME_AXIS = np.radians(3.0)  # that the up of handheld cameras around a levelled scene errs
CLEAR = 3.0  # times as probable as up of the cameras another axis is, if they do not fit what is seen
ASIDE = np.radians(60.0)  # from up of the cameras to an axis that may stand for it
AGAINST_STATED = np.radians(45.0)
MOST_ROWS = 60_000
SIDE = 128  # pixels of the wider side of a picture
SEEN = 0.5  # alpha from which a pixel is covered
# Covered pixels over the least and the most of the ring: photographs are taken from other distances.
LESS, MORE = 1 / 3, 1.6
FULL = 0.8  # share that is covered from inside
LEVELS = (0.1, 0.9)  # quantiles of the elevations between which the first view is
# What makes a camera as good as another one: off the middle, off the typical distance (a factor), off the
# elevation and the azimuth of a view that the scene itself would have, and rolled.
OFF_AXIS, OFF_DISTANCE, OFF_LEVEL, OFF_FRONT, ROLLED = np.radians(15.0), 1.5, *np.radians((15.0, 60.0, 10.0))
LEAST_DISTANCE = 1e-9  # of that of the farthest camera
MOST_KEPT = 500  # standpoints in a first view


class UnfitError(ValueError):
    """Cameras that do not fit a scene: why, in words that follow "but"."""


@dataclass(frozen=True, eq=False)
class Poses:
    """Where n cameras stand, and how they are turned.

    Attributes:
        places: [n, 3] world units.
        axes: [n, 3, 3] rows right, down, forward in world axes.
    """

    places: F64
    axes: F64

    @classmethod
    def of(cls, cameras: list[Camera]) -> "Poses":
        """The poses of n >= 1 cameras."""
        axes = np.array([camera.viewmat[:3, :3] for camera in cameras])
        shifts = np.array([camera.viewmat[:3, 3] for camera in cameras])
        return cls(-np.einsum("nij,ni->nj", axes, shifts), axes)


def photographed_view(
    gaussians: Gaussians, cameras: list[Camera], *, up: F64 | None = None, azimuth: float | None = None
) -> FirstView:
    """The first view of a scene by the cameras of its photographs.

    Up is what they agree on, or an axis or the normal of the ground next to that. Azimuth and elevation are
    those of the camera that stands nearest to where the scene itself would be seen from; its subject is
    framed from there, and what is seen from inside is seen from where that camera stands.

    Args:
        gaussians: N >= 1 Gaussians.
        cameras: that may be those of the photographs.
        up: [3] unit vector, world axes, where it is stated.
        azimuth: radians, where it is given: the camera that stands nearest gives the elevation.

    Raises:
        UnfitError: if the cameras do not fit the scene.
    """
    if len(cameras) < FEWEST:
        raise UnfitError(f"it holds only {len(cameras)} camera{'s' * (len(cameras) > 1)}")
    poses = Poses.of(cameras)
    sees = _check_aim(gaussians, cameras, poses)
    view = find_first_view(gaussians, up=_up(gaussians, poses, up), azimuth=azimuth)
    angles, best = _standpoints(view, poses, sees)
    _check_covered(gaussians, view, cameras[best])
    kept = np.flatnonzero(sees)[:: -(-int(sees.sum()) // MOST_KEPT)]
    return replace(
        view,
        azimuth=float(angles[best, 0]),
        elevation=float(angles[best, 1]),
        eye=None if view.eye is None else poses.places[best],
        stood=angles[kept],
    )


def up_of(poses: Poses) -> F64:
    """[3] unit vector, world axes, that cameras agree to be up: perpendicular to their right axes.

    Where all stand on one side it is the mean of their up axes.

    Raises:
        UnfitError: if they do not agree.
    """
    rights, weights = poses.axes[:, 0], np.ones(len(poses.axes))
    for _ in range(ROUNDS):
        spread, directions = np.linalg.eigh((rights * weights[:, None]).T @ rights / weights.sum())
        normal = np.asarray(directions[:, 0])
        rolls = np.abs(rights @ normal)
        scale = max(1.48 * float(np.median(rolls)), LEAST_ROLL)
        weights = 1 / (1 + (rolls / scale) ** 2) ** 2
    disagree = "its cameras do not agree on which way is up"
    if spread[1] < WIDE:
        mean = -poses.axes[:, 1].mean(axis=0)
        length = float(np.linalg.norm(mean))
        if length < AGREEING:
            raise UnfitError(disagree)
        return _axis_near(np.asarray(mean / length), NEAR_AXIS)
    if np.median(rolls) > np.sin(MOST_ROLL):
        raise UnfitError(disagree)
    upwards = -poses.axes[:, 1:].sum(axis=(0, 1))  # also of cameras that look straight down
    return _axis_near(normal * np.sign(normal @ upwards), SAME_AXIS)


def up_of_views(gaussians: Gaussians, cameras: list[Camera]) -> F64:
    """[3] unit vector, world axes, that is up in given views: where they do not agree, the likeliest axis.

    Args:
        gaussians: the scene, N >= 1.
        cameras: at least one; one alone is taken to be held level.
    """
    poses = Poses.of(cameras)
    if len(cameras) >= FEWEST:
        try:
            return up_of(poses)
        except UnfitError:
            pass
    right, down, _ = poses.axes[0]
    ups = [np.array(AXES[name]) for name, _ in rank_ups(gaussians)]
    held = [up for up in ups if abs(right @ up) < np.sin(NEAR_AXIS) and down @ up < 0]
    return [*held, *ups][0]


def _up(gaussians: Gaussians, poses: Poses, stated: F64 | None) -> F64:
    """[3] up of the cameras, or as stated, if neither a statement nor the scene is against the cameras."""
    found = up_of(poses)
    seen = up_text(_rounded(found))
    if stated is not None:
        if _between(found, stated) > AGAINST_STATED:
            raise UnfitError(f"its cameras have {seen} up, and {up_text(stated)} is stated")
        return stated
    ups = rank_ups(gaussians)
    chance = max(share for name, share in ups if _between(found, np.array(AXES[name])) <= ASIDE)
    if ups[0][1] > CLEAR * chance:
        raise UnfitError(f"its cameras have {seen} up, and the scene more likely {ups[0][0]}")
    return level_up(gaussians, found)


def _check_aim(gaussians: Gaussians, cameras: list[Camera], poses: Poses) -> Mask:
    """[n] which cameras see the middle of the subject.

    Raises:
        UnfitError: if they are too few, or their axes meet elsewhere.
    """
    points, _ = subject(gaussians)
    low, high = points.min(axis=0), points.max(axis=0)
    middle, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    sees = np.array([_sees(camera, middle) for camera in cameras])
    if sees.mean() < SEE_MIDDLE:
        share = f"{int(sees.sum()):,} of its {len(sees):,} cameras"
        raise UnfitError(f"only {share} see the middle of the subject")
    if np.linalg.norm(_meeting(poses, middle) - middle) > OFF_MIDDLE * radius:
        raise UnfitError("its cameras look past the middle of the subject")
    return sees


def _sees(camera: Camera, point: F64) -> bool:
    """Whether a point [3] is in the picture."""
    seen = camera.viewmat[:3, :3] @ point + camera.viewmat[:3, 3]
    x, y, z = camera.K @ seen
    return bool(z > 0 and 0 <= x <= camera.width * z and 0 <= y <= camera.height * z)


def _meeting(poses: Poses, middle: F64) -> F64:
    """[3] the point that is nearest to the axes of all cameras; where they are parallel, near the middle."""
    forward = poses.axes[:, 2]
    across = np.eye(3) - forward[:, :, None] * forward[:, None, :]
    offsets = np.einsum("nij,nj->i", across, poses.places - middle)
    return np.asarray(middle + np.linalg.solve(across.sum(axis=0) + HELD * len(forward) * np.eye(3), offsets))


def _standpoints(view: FirstView, poses: Poses, sees: Mask) -> tuple[F64, int]:
    """Azimuth and elevation of each camera [n, 2], radians, and the row of the one that is taken."""
    middle = 0.5 * (view.points.min(axis=0) + view.points.max(axis=0))
    offsets = poses.places - middle
    distances = np.linalg.norm(offsets, axis=1)
    distances = np.maximum(distances, LEAST_DISTANCE * distances.max())
    toward = offsets / distances[:, None] if view.eye is None else -poses.axes[:, 2]
    right, down, forward = camera_axes(view.up, 0.0, 0.0)
    azimuths = np.arctan2(toward @ right, -(toward @ forward))
    elevations = -np.arcsin(np.clip(toward @ down, -1, 1))
    usual = default_elevation(view.points, view.up) if view.eye is None else 0.0
    level = np.clip(usual, *np.quantile(elevations[sees], LEVELS))
    aim = np.einsum("ni,ni->n", -poses.axes[:, 2], offsets) / distances
    turns = (azimuths - view.azimuth + np.pi) % (2 * np.pi) - np.pi
    costs = (
        np.arccos(np.clip(aim, -1, 1)) / OFF_AXIS
        + np.abs(np.log(distances / np.median(distances[sees]))) / np.log(OFF_DISTANCE)
        + np.abs(elevations - level) / OFF_LEVEL
        + np.abs(turns) / OFF_FRONT
        + np.abs(np.arcsin(np.clip(poses.axes[:, 0] @ view.up, -1, 1))) / ROLLED
    )
    best = int(np.argmin(np.where(sees, costs, np.inf)))
    return np.stack([azimuths, elevations], axis=1), best


def _check_covered(gaussians: Gaussians, view: FirstView, camera: Camera) -> None:
    """Raises UnfitError if the picture of a camera is not as full as those from around the subject."""
    scene, paint = thin(gaussians, np.arange(len(gaussians)), MOST_ROWS), Painter()

    def covered(seen: Camera) -> float:
        return float((paint(scene, _in_small(seen)).alpha > SEEN).mean())

    middle = 0.5 * (view.points.min(axis=0) + view.points.max(axis=0))
    away = float(np.linalg.norm(camera.position - middle))
    share = covered(replace(camera, near=max(NEAR_SHARE * away, 1e-300)))
    if view.eye is not None:
        least, most = FULL, 1.0
    else:
        around = [covered(one) for one in ring_views(view, 4 * SIDE, 3 * SIDE)]
        least, most = LESS * min(around), min(MORE * max(around), 1.0)
    if not least <= share <= most:
        usual = f"{least:.0%} or more" if share < least else f"at most {most:.0%}"
        raise UnfitError(f"the scene fills {share:.0%} of the picture of its best camera, not {usual}")


def _in_small(camera: Camera) -> Camera:
    """The same view, edge to edge, at most `SIDE` pixels wide and high."""
    scale = SIDE / max(camera.width, camera.height)
    width, height = (max(1, round(side * scale)) for side in (camera.width, camera.height))
    K = np.diag([width / camera.width, height / camera.height, 1.0]) @ camera.K
    return replace(camera, K=K, width=width, height=height)


def _axis_near(up: F64, reach: float) -> F64:
    """The axis of the scene within so many radians of a unit vector [3], or that itself."""
    nearest = np.array(max(AXES.values(), key=lambda axis: float(np.dot(axis, up))))
    return nearest if _between(nearest, up) <= reach else up


def _rounded(up: F64) -> F64:
    return np.round(up, 2) + 0.0


def _between(one: F64, other: F64) -> float:
    """Radians between unit vectors [3]."""
    return float(np.arccos(np.clip(one @ other, -1, 1)))
