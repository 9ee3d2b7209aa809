"""A camera for a scene that comes without one: the subject right side up and large in the picture.

A trained scene is a subject in the middle of whatever else the photographs saw: floaters, walls, sky,
at times 2e7 units away. So the frame is fitted to where the visible mass lies close together, and
what lies outside is drawn but does not decide.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from brushgs.scene import Camera, Gaussians

# A scene file does not say which way is up. COLMAP's cameras have y down, and trainers keep its axes.
DEFAULT_UP = "-y"
AXES = {
    sign + axis: tuple(float(s) for s in np.sign(float(f"{sign}1")) * np.eye(3)["xyz".index(axis)])
    for sign in "+-"
    for axis in "xyz"
}
DEFAULT_AZIMUTH = np.radians(30.0)
DEFAULT_ELEVATION = np.radians(15.0)
FLAT_ELEVATION = np.radians(40.0)  # default where the subject is a stretch of ground, seen from the air
FLAT_HEIGHT = 0.15  # that is: its height over its width
DEFAULT_FOV_Y = np.radians(50.0)
MARGIN = 0.05  # of the picture, left free on each side of the subject
TAIL = 0.007  # share of the mass beyond each end of an axis that may be floaters
TIP = 0.15  # of the spread: how far an ear or a chair leg may reach beyond those percentiles
# A captured object spans 1.4 to 3.1 times the spread of its middle half, an object in its surroundings
# (a truck on a plaza, fruit before a wall) 3.9 and more: there only the middle is the subject.
MAX_OBJECT_SPAN = 3.5
SUBJECT_REACH = 0.9  # of that spread, to each side of the median
MAX_POINTS = 20_000  # enough to find bounds; the frame of a larger scene is fitted to every n-th Gaussian
NEAR_SHARE = 0.01  # near plane over distance to the subject: what hangs before the lens is cut away


def up_vector(text: str) -> NDArray[np.float64]:
    """The direction named by "+y", "-y", "+z" ... (a sign may lack: "z"), or by three numbers "0,0.1,-1".

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
    """The direction [3] that is meant by a name, as `up_vector` reads it, or by three numbers of any length.

    Raises:
        ValueError: if a name means nothing.
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
    """A camera that sees the subject of a scene whole, as large as the picture allows.

    Args:
        gaussians: N Gaussians, N >= 1.
        width: pixels.
        height: pixels.
        fov_y: vertical field of view, radians, in (0, pi).
        up: [3] direction that is up in the picture, world axes, any length.
        azimuth: radians; 0 looks at the front of the scene (from -z where up is -y, from -y where up
            is +z, from +z where up is +y), growing to the viewer's right.
        elevation: radians above the horizon, -pi/2 to pi/2; None for `default_elevation`.
        zoom: 1 shows the subject whole, 2 shows it twice as large (the camera stays, the field of
            view narrows), > 0.

    Raises:
        ValueError: if there is no Gaussian or a number is out of range.
    """
    if len(gaussians) == 0:
        raise ValueError("frame_scene: gaussians must have at least one row to be looked at, got none")
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

    The spread is the greatest interquartile range of the three axes, the weight the opacity. Along
    each axis those Gaussians count that lie between the percentiles at `TAIL` and 1 - `TAIL`, `TIP`
    spreads wider; where these are further apart than `MAX_OBJECT_SPAN` spreads, those within
    `SUBJECT_REACH` spreads of the median.

    Returns:
        [n, 3] centres of at most `MAX_POINTS` Gaussians that belong to the subject, and whether it
        stands in surroundings that were left out.
    """
    every = slice(None, None, -(-len(gaussians) // MAX_POINTS))
    means = gaussians.means[every].astype(np.float64)
    weights = gaussians.opacities[every].astype(np.float64)
    if not weights.any():
        weights = np.ones(len(means))
    at = (TAIL, 0.25, 0.5, 0.75, 1 - TAIL)
    low, q1, median, q3, high = np.transpose([weighted_quantiles(column, weights, at) for column in means.T])
    spread = (q3 - q1).max()
    has_surroundings = bool((high - low).max() > MAX_OBJECT_SPAN * spread > 0)
    if has_surroundings:
        low = np.maximum(low, median - SUBJECT_REACH * spread)
        high = np.minimum(high, median + SUBJECT_REACH * spread)
    else:
        low, high = low - TIP * spread, high + TIP * spread
    inside = ((means >= low) & (means <= high)).all(axis=1) & (weights > 0)
    return means[inside] if inside.any() else means, has_surroundings


def default_elevation(points: NDArray[np.float64], up: ArrayLike) -> float:
    """Radians above the horizon from which `points` [n, 3] show best: higher where they are flat ground."""
    axes = camera_axes(np.asarray(up, dtype=np.float64), 0.0, 0.0)
    width, height, depth = np.ptp(points @ axes.T, axis=0)
    is_flat = height < FLAT_HEIGHT * max(width, depth)
    return float(FLAT_ELEVATION if is_flat else DEFAULT_ELEVATION)


def weighted_quantiles(
    values: NDArray[np.float64], weights: NDArray[np.float64], at: tuple[float, ...]
) -> list[float]:
    """Values below which the given shares of the weight lie."""
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
    level = np.cos(azimuth) * front + np.sin(azimuth) * right  # towards the camera, along the ground
    forward = -(np.cos(elevation) * level + np.sin(elevation) * up)
    right = np.cos(azimuth) * right - np.sin(azimuth) * front
    return np.stack([right, np.cross(forward, right), forward])


def _front(up: NDArray[np.float64]) -> NDArray[np.float64]:
    """[3] where the viewer stands at azimuth 0: at -z if y is down, turned along for other axes."""
    nearest = int(np.argmax(np.abs(up)))
    sign = np.sign(up[nearest])
    front = np.zeros(3)
    front[(2, 2, 1)[nearest]] = (sign, sign, -sign)[nearest]
    front -= (front @ up) * up
    return np.asarray(front / np.linalg.norm(front))


def fit_eye(points: NDArray[np.float64], tangents: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """The nearest eye, in turned axes, from which all points lie inside the frustum with a margin.

    A point is inside the right plane where x - t z <= eye_x - t eye_z, so only the outermost point per
    plane counts, and opposite planes together bound eye_z.

    Returns:
        [3] eye and its distance to the middle of the points.
    """
    tangents = tangents * (1 - 2 * MARGIN)
    xy, z = points[:, :2], points[:, 2:]
    high, low = (xy - tangents * z).max(axis=0), (-xy - tangents * z).max(axis=0)
    middle = np.median(z)
    size = max(float(np.ptp(points, axis=0).max()), 1e-6 * float(np.abs(points).max()), 1e-9)
    # A very wide lens could fit the points from among them: the eye stays before the nearest, too.
    in_front = min(middle - 0.5 * size, float(z.min()) - 0.05 * size)
    eye_z = min(float((-(high + low) / (2 * tangents)).min()), in_front)
    depths = z[:, 0] - eye_z
    return np.array([*(_center(column, depths) for column in xy.T), eye_z]), float(middle - eye_z)


def _center(x: NDArray[np.float64], depths: NDArray[np.float64]) -> float:
    """Place of the eye on an axis from which the outermost points lie equally far from the middle.

    Found by bisection: the sum of the two outermost slopes falls as the eye moves on.
    """
    slopes, per_step = x / depths, 1 / depths
    low, high = float(x.min()), float(x.max())
    for _ in range(30):
        eye = 0.5 * (low + high)
        seen = slopes - eye * per_step
        low, high = (eye, high) if seen.max() + seen.min() > 0 else (low, eye)
    return 0.5 * (low + high)
