"""A camera for a scene that comes without one: the subject upright and large in the picture.

A trained scene is a subject in the middle of all else that the photographs showed: floaters, walls, sky, at
times 2e7 units away. So the frame is fitted to where most of the opacity lies close together; what lies
outside is painted but does not change the frame.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from brushgs.scene import Camera, Gaussians

# Most scene files do not state which way is up. COLMAP's cameras have y down, and trainers keep its axes.
DEFAULT_UP = "-y"
AXES = {
    sign + axis: tuple(float(s) for s in np.sign(float(f"{sign}1")) * np.eye(3)["xyz".index(axis)])
    for sign in "+-"
    for axis in "xyz"
}
DEFAULT_AZIMUTH = np.radians(30.0)
DEFAULT_ELEVATION = np.radians(15.0)
FLAT_ELEVATION = np.radians(40.0)  # default where the subject is flat ground, seen from above
FLAT_HEIGHT = 0.15  # of height over width: below, a subject is flat
DEFAULT_FOV_Y = np.radians(50.0)
MARGIN = 0.05  # share of the picture that is empty on each side of the subject
TAIL = 0.007  # share of the opacity beyond each end of an axis that may be floaters
TIP = 0.15  # interquartile ranges by which an ear or a chair leg may extend beyond those percentiles
# A captured object spans 1.4 to 3.1 interquartile ranges, an object in surroundings (a truck on a plaza,
# fruit in front of a wall) 3.9 and more: there only the middle is the subject.
MAX_OBJECT_SPAN = 3.5
SUBJECT_REACH = 0.9  # interquartile ranges to each side of the median
MAX_POINTS = 20_000  # enough for bounds: of a larger scene every n-th Gaussian is used
NEAR_SHARE = 0.01  # near plane over distance to the subject: floaters in front of the lens are clipped


def up_vector(text: str) -> NDArray[np.float64]:
    """The direction named by "+y", "-y", "+z" ... (without a sign, as "z": +), or by numbers as "0,0.1,-1".

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
    """The direction [3] given by a name, see `up_vector`, or by three numbers, which are not normalised.

    Raises:
        ValueError: if the name is unknown.
    """
    return up_vector(up) if isinstance(up, str) else np.asarray(up, dtype=np.float64)


def frame_scene(
    gaussians: Gaussians,
    *,
    width: int,
    height: int,
    fov_y: float = DEFAULT_FOV_Y,
    up: ArrayLike = AXES[DEFAULT_UP],
    azimuth: float = DEFAULT_AZIMUTH,
    elevation: float | None = None,
    zoom: float = 1.0,
) -> Camera:
    """A camera that shows the whole subject of a scene, as large as the picture allows.

    Args:
        gaussians: N Gaussians, N >= 1.
        width: pixels.
        height: pixels.
        fov_y: vertical field of view, radians, in (0, pi).
        up: [3] direction that is up in the picture, world axes, any length.
        azimuth: radians; 0 is a view of the front (from -z where up is -y, from -y where up is +z, from +z
            where up is +y), and the camera moves to the viewer's right as it grows.
        elevation: radians above the horizon, -pi/2 to pi/2; None for `default_elevation`.
        zoom: 1 shows the subject whole, 2 shows it twice as large (the camera stays, the field of
            view narrows), > 0.

    Raises:
        ValueError: if there is no Gaussian or a number is out of range.
    """
    if len(gaussians) == 0:
        raise ValueError("frame_scene: gaussians must have at least one row, got none")
    if not zoom > 0 or not np.isfinite(zoom):
        raise ValueError(f"frame_scene: zoom must be > 0, got {zoom}")
    if not 0 < fov_y < np.pi:
        raise ValueError(f"frame_scene: fov_y must be in (0, pi) radians, got {fov_y}")
    points, _ = subject(gaussians)
    direction = np.asarray(up, dtype=np.float64)
    if elevation is None:
        elevation = default_elevation(points, direction)
    if not abs(elevation) <= np.pi / 2:
        raise ValueError(f"frame_scene: elevation must lie in -pi/2 to pi/2 radians, got {elevation}")
    axes = camera_axes(direction, azimuth, elevation)
    eye, distance = fit_eye(points @ axes.T, np.tan(0.5 * fov_y) * np.array([width / height, 1.0]))
    viewmat = np.eye(4)
    viewmat[:3, :3] = axes
    viewmat[:3, 3] = -eye
    focal = zoom * 0.5 * height / np.tan(0.5 * fov_y)
    K = np.array([[focal, 0.0, 0.5 * width], [0.0, focal, 0.5 * height], [0.0, 0.0, 1.0]])
    return Camera(viewmat, K, width, height, near=NEAR_SHARE * distance)


def subject(gaussians: Gaussians) -> tuple[NDArray[np.float64], bool]:
    """Where the subject of a scene is.

    Quantiles are weighted by opacity; the unit is the largest interquartile range of the three axes. Along
    each axis the subject lies between the quantiles `TAIL` and 1 - `TAIL`, widened by `TIP` units; where they
    are more than `MAX_OBJECT_SPAN` units apart, within `SUBJECT_REACH` units of the median.

    Returns:
        [n, 3] centres of at most `MAX_POINTS` Gaussians of the subject, and whether it has surroundings,
        which are excluded.
    """
    every = slice(None, None, -(-len(gaussians) // MAX_POINTS))
    means = gaussians.means[every].astype(np.float64)
    weights = gaussians.opacities[every].astype(np.float64)
    if not weights.any():
        weights = np.ones(len(means))
    at = (TAIL, 0.25, 0.5, 0.75, 1 - TAIL)
    low, q1, median, q3, high = np.transpose([weighted_quantiles(column, weights, at) for column in means.T])
    unit = (q3 - q1).max()
    has_surroundings = bool((high - low).max() > MAX_OBJECT_SPAN * unit > 0)
    if has_surroundings:
        low = np.maximum(low, median - SUBJECT_REACH * unit)
        high = np.minimum(high, median + SUBJECT_REACH * unit)
    else:
        low, high = low - TIP * unit, high + TIP * unit
    inside = ((means >= low) & (means <= high)).all(axis=1) & (weights > 0)
    return means[inside] if inside.any() else means, has_surroundings


def default_elevation(points: NDArray[np.float64], up: ArrayLike) -> float:
    """Default elevation of a view of `points` [n, 3], radians above the horizon: higher for flat ground."""
    axes = camera_axes(np.asarray(up, dtype=np.float64), 0.0, 0.0)
    width, height, depth = np.ptp(points @ axes.T, axis=0)
    is_flat = height < FLAT_HEIGHT * max(width, depth)
    return float(FLAT_ELEVATION if is_flat else DEFAULT_ELEVATION)


def weighted_quantiles(
    values: NDArray[np.float64], weights: NDArray[np.float64], at: tuple[float, ...]
) -> list[float]:
    """Weighted quantiles of `values` at the given shares of the weight."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weights[order])
    rows = np.searchsorted(total, np.asarray(at) * total[-1])
    return [float(v) for v in values[order][np.minimum(rows, len(values) - 1)]]


def camera_axes(up: NDArray[np.float64], azimuth: float, elevation: float) -> NDArray[np.float64]:
    """[3, 3] rows right, down, forward in world axes."""
    length = np.linalg.norm(up)
    if up.shape != (3,) or not 0 < length < np.inf:
        raise ValueError(f"frame_scene: up must be a direction of three numbers, got {up.tolist()}")
    up = up / length
    front = _front(up)
    right = np.cross(up, front)
    level = np.cos(azimuth) * front + np.sin(azimuth) * right  # towards the camera, horizontally
    forward = -(np.cos(elevation) * level + np.sin(elevation) * up)
    right = np.cos(azimuth) * right - np.sin(azimuth) * front
    return np.stack([right, np.cross(forward, right), forward])


def _front(up: NDArray[np.float64]) -> NDArray[np.float64]:
    """[3] direction to the viewer at azimuth 0: -z if y is down, and accordingly for other axes."""
    nearest = int(np.argmax(np.abs(up)))
    sign = np.sign(up[nearest])
    front = np.zeros(3)
    front[(2, 2, 1)[nearest]] = (sign, sign, -sign)[nearest]
    front -= (front @ up) * up
    return np.asarray(front / np.linalg.norm(front))


def fit_eye(points: NDArray[np.float64], tangents: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """The nearest eye, in camera axes, from which all points lie inside the frustum with a margin.

    A point is inside the right plane where x - t z <= eye_x - t eye_z, so only the outermost point per plane
    counts, and two opposite planes together bound eye_z.

    Returns:
        [3] eye and its distance to the median depth of the points.
    """
    tangents = tangents * (1 - 2 * MARGIN)
    xy, z = points[:, :2], points[:, 2:]
    high, low = (xy - tangents * z).max(axis=0), (-xy - tangents * z).max(axis=0)
    middle = np.median(z)
    size = max(float(np.ptp(points, axis=0).max()), 1e-6 * float(np.abs(points).max()), 1e-9)
    # A very wide lens could fit the points from among them: the eye stays in front of the nearest.
    in_front = min(middle - 0.5 * size, float(z.min()) - 0.05 * size)
    eye_z = min(float((-(high + low) / (2 * tangents)).min()), in_front)
    depths = z[:, 0] - eye_z
    return np.array([*(_center(column, depths) for column in xy.T), eye_z]), float(middle - eye_z)


def _center(x: NDArray[np.float64], depths: NDArray[np.float64]) -> float:
    """Coordinate of the eye from which the outermost points are equally far from the middle of the picture.

    By bisection: the sum of the two outermost slopes decreases with the coordinate.
    """
    slopes, per_step = x / depths, 1 / depths
    low, high = float(x.min()), float(x.max())
    for _ in range(30):
        eye = 0.5 * (low + high)
        seen = slopes - eye * per_step
        low, high = (eye, high) if seen.max() + seen.min() > 0 else (low, eye)
    return 0.5 * (low + high)
