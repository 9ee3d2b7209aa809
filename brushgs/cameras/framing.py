"""Framing: a camera that shows the subject of a scene upright and large.

A trained scene contains a subject and its surroundings: floaters, walls, sky, at times 2e7 units away. The
frame is fitted to the dense middle of the opacity; the rest is painted but does not change the frame.

Only the `FirstView` of a scene is used: strokes that store it are framed exactly like their scene.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import radians
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from brushgs.cameras.clumps import TAIL
from brushgs.cameras.outline import outline
from brushgs.core.native import core as _core
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians

# Framing target: the subject; the scene with its surroundings; "part", the upper third of the subject, where
# heads are; or a point [3] to center, seen from the distance of the subject.
LookAt = Literal["subject", "scene", "part"] | Sequence[float]

# Most scene files do not state the up axis. COLMAP's cameras have y down, and trainers keep its axes.
DEFAULT_UP = "-y"
AXES = {
    sign + axis: tuple(float(s) for s in np.sign(float(f"{sign}1")) * np.eye(3)["xyz".index(axis)])
    for sign in "+-"
    for axis in "xyz"
}
DEFAULT_AZIMUTH = radians(30.0)
FLAT_ELEVATION: float = _core.FLAT_ELEVATION  # default for flat ground
FLAT_HEIGHT: float = _core.FLAT_HEIGHT  # of height over width: below, a subject is flat
DEFAULT_FOV_Y = radians(50.0)
MARGIN = 0.05  # empty share of the picture on each side of the subject
# For bounds: of larger scenes every n-th Gaussian is used.
MAX_POINTS: int = _core.MOST_SUBJECT_ROWS
NEAR_SHARE = 0.01  # near plane over distance to the subject, to clip floaters in front of the lens
INSIDE_NEAR_SHARE = 0.002  # near plane over size of the subject, for cameras inside
PART = 1 / 3  # of the height of the subject, from its top


def up_vector(text: str) -> NDArray[np.float64]:
    """The direction of "+y", "-y", "z" (same as "+z"), or of numbers such as "0,0.1,-1".

    Returns:
        [3] unit vector in world axes.

    Raises:
        ValueError: if the text is neither.
    """
    name = text.strip().lower()
    if name in AXES or f"+{name}" in AXES:
        return np.array(AXES.get(name, AXES.get(f"+{name}")))
    try:
        vector = np.array([float(number) for number in name.replace(",", " ").split()])
    except ValueError:
        vector = np.zeros(0)
    length = np.linalg.norm(vector)
    if vector.shape != (3,) or not 0 < length < np.inf:
        raise ValueError(f"up must be one of {', '.join(AXES)} or three numbers such as 0,-1,0, got {text!r}")
    return np.asarray(vector / length)


def direction_of(up: str | ArrayLike) -> NDArray[np.float64]:
    """The direction [3] of a name, see `up_vector`, or of three numbers, not normalized.

    Raises:
        ValueError: if the name is unknown.
    """
    return up_vector(up) if isinstance(up, str) else np.asarray(up, dtype=np.float64)


def plain_first_view(gaussians: Gaussians, up: str | ArrayLike = DEFAULT_UP) -> FirstView:
    """The first view of a scene without estimates: default azimuth and elevation for a given up.

    Args:
        gaussians: N Gaussians, N >= 1.
        up: axis by name, or [3] direction of any length in world axes.

    Raises:
        ValueError: if there is no Gaussian, or `up` is not a direction.
    """
    if len(gaussians) == 0:
        raise ValueError("frame_scene: gaussians must have at least one row, got none")
    points, has_surroundings = subject(gaussians)
    view = FirstView(
        points=outline(points),
        up=np.zeros(3),
        azimuth=0.0,
        elevation=0.0,
        has_surroundings=has_surroundings,
        whole=scene_bounds(gaussians) if has_surroundings else None,
    )
    return with_up(view, up)


def with_up(view: FirstView, up: str | ArrayLike) -> FirstView:
    """The view from outside for another up axis, with default azimuth and elevation."""
    direction = direction_of(up)
    camera_axes(direction, 0.0, 0.0)  # checks it
    return replace(
        view,
        up=unit_of(direction),
        azimuth=DEFAULT_AZIMUTH,
        elevation=default_elevation(view.points, direction),
        front=0.0,
        eye=None,
        probability=None,
        ups=(),
    )


def unit_of(up: str | ArrayLike) -> NDArray[np.float64]:
    """`direction_of`, at length 1. Raises the same."""
    direction = direction_of(up)
    return np.asarray(direction / np.linalg.norm(direction))


def frame_scene(
    scene: Gaussians | FirstView,
    *,
    width: int,
    height: int,
    fov_y: float = DEFAULT_FOV_Y,
    up: ArrayLike | None = None,
    azimuth: float | None = None,
    elevation: float | None = None,
    zoom: float = 1.0,
    look_at: LookAt | None = None,
    distance: float | None = None,
    pan: Sequence[float] = (0.0, 0.0),
    roll: float = 0.0,
) -> Camera:
    """A camera that shows the whole subject of a scene, as large as the picture allows.

    If the first view has an `eye`, azimuth and elevation turn the camera there, unless `look_at` requests a
    view from outside.

    Args:
        scene: N Gaussians, N >= 1 (with `plain_first_view`), or the first view of a scene.
        width: pixels.
        height: pixels.
        fov_y: vertical field of view, radians, in (0, pi).
        up: [3] up direction in world axes, any length; None for that of the first view.
        azimuth: radians, growing as the camera moves to the viewer's right; 0 is a view from -z for up -y,
            from -y for up +z, and from +z for up +y. None for that of the first view.
        elevation: radians above the horizon, -pi/2 to pi/2; None for that of the first view (for Gaussians
            `default_elevation`).
        zoom: 1 shows the whole subject, 2 twice as large (same position, narrower field of view), > 0.
        look_at: framing target, see `LookAt`; None for the subject, or the view from inside.
        distance: from the camera to the point `look_at`, world units, > 0; None for that of the subject.
        pan: (right, up) shift of the camera without turning, in shares of the picture's width and height at
            the distance of the target.
        roll: rotation of the scene in the picture, radians clockwise.

    Raises:
        ValueError: if there is no Gaussian or a number is out of range.
    """
    if not zoom > 0 or not np.isfinite(zoom):
        raise ValueError(f"frame_scene: zoom must be > 0, got {zoom}")
    if not 0 < fov_y < np.pi:
        raise ValueError(f"frame_scene: fov_y must be in (0, pi) radians, got {fov_y}")
    if distance is not None and (not 0 < distance < np.inf or point_of(look_at) is None):
        raise ValueError(f"frame_scene: distance must be > 0, and look_at a point, got {distance}, {look_at}")
    view = first_view_of(scene, up)
    azimuth, elevation = angles_of(view, azimuth, elevation)
    axes = rolled(camera_axes(view.up, azimuth, elevation), roll)
    K = lens(width, height, fov_y, zoom)
    if view.eye is not None and look_at is None:
        eye, away = axes @ view.eye, distance_ahead(view, axes)
        near = INSIDE_NEAR_SHARE * _size(view.points)
    else:
        points = points_of(view, look_at)
        eye, away = fit_eye(points @ axes.T, np.tan(0.5 * fov_y) * np.array([width / height, 1.0]))
        if (point := point_of(look_at)) is not None:
            eye, away = eye_before(axes @ point, away if distance is None else distance)
        near = NEAR_SHARE * away
    viewmat = np.eye(4)
    viewmat[:3, :3] = axes
    viewmat[:3, 3] = -(eye + aside(pan, K, away))
    return Camera(viewmat, K, width, height, near=near)


def first_view_of(scene: Gaussians | FirstView, up: str | ArrayLike | None) -> FirstView:
    """The first view of a scene with an up axis; None keeps that of the view, or takes the default."""
    if isinstance(scene, FirstView):
        return scene if up is None else with_up(scene, up)
    return plain_first_view(scene, DEFAULT_UP if up is None else up)


def angles_of(view: FirstView, azimuth: float | None, elevation: float | None) -> tuple[float, float]:
    """Azimuth and elevation, radians; those of the first view for None.

    Raises:
        ValueError: if the elevation is out of range.
    """
    azimuth = view.azimuth if azimuth is None else azimuth
    elevation = view.elevation if elevation is None else elevation
    if not abs(elevation) <= np.pi / 2:
        raise ValueError(f"frame_scene: elevation must lie in -pi/2 to pi/2 radians, got {elevation}")
    return azimuth, elevation


def points_of(view: FirstView, look_at: LookAt | None) -> NDArray[np.float64]:
    """[m, 3] points to show whole; the subject if `look_at` is a point."""
    if look_at == "scene" and view.whole is not None:
        return _corners(*view.whole)
    if look_at == "part":
        level = camera_axes(view.up, 0.0, 0.0)
        places = view.points @ level.T
        top, height = places[:, 1].min(), np.ptp(places[:, 1])  # y is down
        upper = places[places[:, 1] <= top + PART * height]
        middle, half = 0.5 * (upper.min(axis=0) + upper.max(axis=0)), 0.5 * np.ptp(upper, axis=0)
        middle[1] = top + 0.5 * PART * height
        half = np.maximum(half, 0.5 * PART * height)  # include the surroundings of a tip
        return _corners(middle - half, middle + half) @ level
    return view.points


def point_of(look_at: LookAt | None) -> NDArray[np.float64] | None:
    """[3] the point to center; None if `look_at` is not a point."""
    return None if look_at is None or isinstance(look_at, str) else np.asarray(look_at, dtype=np.float64)


def eye_before(point: NDArray[np.float64], distance: float) -> tuple[NDArray[np.float64], float]:
    """The eye [3] with a point [3] in the middle of its picture, both in camera axes; and its distance."""
    return point - (0.0, 0.0, distance), distance


def lens(width: int, height: int, fov_y: float, zoom: float) -> NDArray[np.float64]:
    """[3, 3] pinhole intrinsics, pixels. The arguments are those of `frame_scene`."""
    focal = zoom * 0.5 * height / np.tan(0.5 * fov_y)
    return np.array([[focal, 0.0, 0.5 * width], [0.0, focal, 0.5 * height], [0.0, 0.0, 1.0]])


def aside(pan: Sequence[float], K: NDArray[np.float64], distance: float) -> NDArray[np.float64]:
    """[3] shift of a camera with intrinsics K by `pan`, camera axes, see `frame_scene`."""
    width, height = 2 * K[0, 2], 2 * K[1, 2]
    return np.asarray(np.array([pan[0] * width, -pan[1] * height, 0.0]) * (distance / K[0, 0]))


def distance_ahead(view: FirstView, axes: NDArray[np.float64]) -> float:
    """Distance from an inside eye to the middle of the subject ahead, for camera axes [3, 3], > 0."""
    assert view.eye is not None, "the view is from outside"
    depths = (view.points - view.eye) @ axes[2]
    farthest = float(depths.max())
    return 0.5 * (max(float(depths.min()), 0.0) + farthest) if farthest > 0 else _size(view.points)


def rolled(axes: NDArray[np.float64], roll: float) -> NDArray[np.float64]:
    """Camera axes [3, 3] rolled so that the scene turns clockwise by `roll` radians."""
    if roll == 0:
        return axes
    cos, sin = np.cos(roll), np.sin(roll)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]) @ axes


def _size(points: NDArray[np.float64]) -> float:
    """Diagonal of the bounds of points, > 0: at least a millionth of the way to the origin."""
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    return max(size, 1e-6 * float(np.abs(points).max())) or 1e-9  # all at the origin


def _corners(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
    """[8, 3] corners of a box."""
    ends = np.stack([low, high])
    return np.stack(np.meshgrid(*ends.T, indexing="ij"), axis=-1).reshape(-1, 3)


def subject(gaussians: Gaussians, *, is_whole: bool = False) -> tuple[NDArray[np.float64], bool]:
    """Find the subject of a scene, in its heaviest clump.

    Quantiles are weighted by opacity; the unit is the largest interquartile range of the three axes. Along
    each axis the subject lies between the quantiles `TAIL` and 1 - `TAIL`, widened by 0.15 units; if these
    are more than 3.5 units apart, within 0.9 units of the median.

    Args:
        gaussians: N Gaussians.
        is_whole: treat the scene as without surroundings, whatever its span.

    Returns:
        [n, 3] centers of at most `MAX_POINTS` Gaussians of the subject, and whether surroundings were
        excluded.
    """
    rows, has_surroundings = _core.find_subject(gaussians.means, gaussians.opacities, is_whole)
    return gaussians.means[rows].astype(np.float64), has_surroundings


def scene_bounds(gaussians: Gaussians) -> NDArray[np.float64]:
    """[2, 3] low and high corner of a scene with its surroundings, without `TAIL` of opacity at each end."""
    means, weights = _sample(gaussians)
    at = (TAIL, 1 - TAIL)
    return np.transpose([weighted_quantiles(column, weights, at) for column in means.T])


def _sample(gaussians: Gaussians) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """[n, 3] centers and [n] weights of at most `MAX_POINTS` Gaussians; the weights are not all 0."""
    every = slice(None, None, -(-len(gaussians) // MAX_POINTS))
    means = gaussians.means[every].astype(np.float64)
    weights = gaussians.opacities[every].astype(np.float64)
    return means, weights if weights.any() else np.ones(len(means))


def default_elevation(points: NDArray[np.float64], up: ArrayLike) -> float:
    """Default elevation of a view of `points` [n, 3], radians above the horizon: higher for flat ground."""
    axes = camera_axes(np.asarray(up, dtype=np.float64), 0.0, 0.0)
    return float(_core.default_elevation(*np.ptp(points @ axes.T, axis=0).tolist()))


def weighted_quantiles(
    values: NDArray[np.float64], weights: NDArray[np.float64], at: tuple[float, ...]
) -> list[float]:
    """Weighted quantiles of `values` at the given shares of the weight."""
    values, weights = (np.ascontiguousarray(column, np.float64) for column in (values, weights))
    return list(_core.weighted_quantiles(values, weights, at))


def camera_axes(up: NDArray[np.float64], azimuth: float, elevation: float) -> NDArray[np.float64]:
    """[3, 3] rows right, down, forward in world axes."""
    length = np.linalg.norm(up)
    if up.shape != (3,) or not 0 < length < np.inf:
        raise ValueError(f"frame_scene: up must be a direction of three numbers, got {up.tolist()}")
    up = up / length
    front = _front(up)
    right = np.cross(up, front)
    level = np.cos(azimuth) * front + np.sin(azimuth) * right  # toward the camera, horizontally
    forward = -(np.cos(elevation) * level + np.sin(elevation) * up)
    right = np.cos(azimuth) * right - np.sin(azimuth) * front
    return np.stack([right, np.cross(forward, right), forward])


def angles_toward(up: NDArray[np.float64], toward: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """Azimuth and elevation [...], radians, of cameras that stand toward unit vectors [..., 3]."""
    right, down, forward = camera_axes(up, 0.0, 0.0)
    return np.arctan2(toward @ right, -(toward @ forward)), -np.arcsin(np.clip(toward @ down, -1, 1))


def _front(up: NDArray[np.float64]) -> NDArray[np.float64]:
    """[3] direction to the viewer at azimuth 0: -z for up -y, see `frame_scene` for others."""
    nearest = int(np.argmax(np.abs(up)))
    sign = np.sign(up[nearest])
    front = np.zeros(3)
    front[(2, 2, 1)[nearest]] = (sign, sign, -sign)[nearest]
    front -= (front @ up) * up
    return np.asarray(front / np.linalg.norm(front))


def fit_eye(points: NDArray[np.float64], tangents: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """The nearest eye, in camera axes, with all points [n, 3] inside the frustum with a margin.

    A point is inside the right plane where x - t z <= eye_x - t eye_z, so only the outermost point per plane
    counts, and two opposite planes together bound eye_z. The outermost points are equally far from the middle
    of the picture.

    Returns:
        [3] eye and its distance to the middle of the depths of the points.
    """
    place, distance = _core.fit_eye(np.ascontiguousarray(points, np.float64), tangents.tolist())
    return np.array(place), distance
