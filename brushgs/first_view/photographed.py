"""The first view of a scene from its capture cameras: cameras -> do they fit? -> up -> first view.

Camera files may belong to another scene, or to the scene before it was turned, moved or cropped. Cameras are
used only if they fit: they look at the subject, their axes meet in its middle, they agree on an up axis that
does not contradict a clear scene, and their pictures are as full as those around the subject. Of 13 real
scenes with the cameras of 7 captures, all 4 matching pairs fit, and 1 of 87 others, a fragment of 1,000
Gaussians. A scene turned about its up axis is not detected.
"""

from dataclasses import dataclass, replace

import numpy as np

from brushgs.cameras.around import ring_views
from brushgs.cameras.first_view import up_text
from brushgs.cameras.framing import AXES, NEAR_SHARE, angles_toward, default_elevation, subject
from brushgs.cameras.ground import level_up
from brushgs.first_view import find_first_view, rank_ups
from brushgs.first_view.sample import Painter, thin
from brushgs.values.arrays import F64, Mask
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians

FEWEST = 3  # cameras: fewer are saved views, and do not determine up
SEE_MIDDLE = 0.8  # share of cameras that see the middle of the subject
OFF_MIDDLE = 0.3  # limit for the distance of axes from the middle, radii: matching cameras have up to 0.15
HELD = 0.02  # pull towards the middle, for parallel axes
ROUNDS = 20  # of reweighted least squares against rolled cameras
LEAST_ROLL = 1e-3  # radians, for rounding
MOST_ROLL = np.radians(15.0)  # median roll above which cameras do not determine up
WIDE = 0.03  # variance of right axes below which all cameras are on one side, and only their mean up is known
AGREEING = 0.5  # least length of the mean up axis
NEAR_AXIS = np.radians(30.0)  # from the mean to an axis of the scene, which is then up: cameras are tilted
SAME_AXIS = np.radians(3.0)  # error of up from handheld cameras around a levelled scene
CLEAR = 3.0  # another axis must be this many times as probable for cameras not to fit
ASIDE = np.radians(60.0)  # from the cameras' up to an equivalent axis
AGAINST_STATED = np.radians(45.0)
MOST_ROWS = 60_000
SIDE = 128  # pixels of the wider side of a picture
SEEN = 0.5  # alpha from which a pixel is covered
# Limits of covered pixels over the least and the most of the ring, for other distances.
LESS, MORE = 1 / 3, 1.6
FULL = 0.8  # covered share from inside
LEVELS = (0.1, 0.9)  # quantiles of elevations that limit the first view
# Deviations of equal penalty: off axis, off the typical distance (a factor), off the elevation and azimuth of
# the estimated view, and roll.
OFF_AXIS, OFF_DISTANCE, OFF_LEVEL, OFF_FRONT, ROLLED = np.radians(15.0), 1.5, *np.radians((15.0, 60.0, 10.0))
LEAST_DISTANCE = 1e-9  # of that of the farthest camera
MOST_KEPT = 500  # standpoints in a first view


class UnfitError(ValueError):
    """Cameras do not fit a scene; the message follows "but"."""


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses of n cameras.

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
    """The first view of a scene from its capture cameras.

    Up is their common up axis, or a scene axis or ground normal close to it. Azimuth and elevation are those
    of the camera nearest to the estimated view; the subject is framed from there, scenes seen from inside use
    the camera's position.

    Args:
        gaussians: N >= 1 Gaussians.
        cameras: possibly those of the capture.
        up: [3] unit vector, world axes, if stated.
        azimuth: radians, if given; the nearest camera gives the elevation.

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
    """[3] common up of cameras, a unit vector in world axes: perpendicular to their right axes.

    If all are on one side, the mean of their up axes.

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
    upwards = -poses.axes[:, 1:].sum(axis=(0, 1))  # also defined for cameras that look straight down
    return _axis_near(normal * np.sign(normal @ upwards), SAME_AXIS)


def up_of_views(gaussians: Gaussians, cameras: list[Camera]) -> F64:
    """[3] up of given views, a unit vector in world axes; the most probable axis if they disagree.

    Args:
        gaussians: the scene, N >= 1.
        cameras: at least one; a single one is assumed level.
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
    """[3] up of the cameras, or `stated`, unless that or the scene contradicts the cameras."""
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
    """[n] mask of cameras that see the middle of the subject.

    Raises:
        UnfitError: if there are too few, or their axes meet elsewhere.
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
    """[3] point nearest to the axes of all cameras; near the middle for parallel axes."""
    forward = poses.axes[:, 2]
    across = np.eye(3) - forward[:, :, None] * forward[:, None, :]
    offsets = np.einsum("nij,nj->i", across, poses.places - middle)
    return np.asarray(middle + np.linalg.solve(across.sum(axis=0) + HELD * len(forward) * np.eye(3), offsets))


def _standpoints(view: FirstView, poses: Poses, sees: Mask) -> tuple[F64, int]:
    """Azimuth and elevation of each camera [n, 2], radians, and the row of the chosen one."""
    middle = 0.5 * (view.points.min(axis=0) + view.points.max(axis=0))
    offsets = poses.places - middle
    distances = np.linalg.norm(offsets, axis=1)
    distances = np.maximum(distances, LEAST_DISTANCE * distances.max())
    toward = offsets / distances[:, None] if view.eye is None else -poses.axes[:, 2]
    azimuths, elevations = angles_toward(view.up, toward)
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
    """Raise UnfitError if the picture of a camera is less full than those around the subject."""
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
    """The scene axis within `reach` radians of a unit vector [3], or the vector itself."""
    nearest = np.array(max(AXES.values(), key=lambda axis: float(np.dot(axis, up))))
    return nearest if _between(nearest, up) <= reach else up


def _rounded(up: F64) -> F64:
    return np.round(up, 2) + 0.0


def _between(one: F64, other: F64) -> float:
    """Radians between unit vectors [3]."""
    return float(np.arccos(np.clip(one @ other, -1, 1)))
