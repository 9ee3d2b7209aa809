"""Cameras on a circle around the subject of a scene."""

import numpy as np
from numpy.typing import ArrayLike

from brushgs.arrays import F64
from brushgs.cameras.framing import (
    AXES,
    DEFAULT_AZIMUTH,
    DEFAULT_FOV_Y,
    DEFAULT_UP,
    NEAR_SHARE,
    camera_axes,
    default_elevation,
    fit_eye,
    frame_scene,
    subject,
)
from brushgs.scene import Camera, Gaussians

_SWEEP_STEPS = 64  # of the circle each outline point sweeps: 0.1 % of its radius is missed
_OUTLINE_STEPS = 181  # directions in which the outermost points are searched


def orbit(
    gaussians: Gaussians,
    num_frames: int,
    *,
    width: int,
    height: int,
    fov_y: float = DEFAULT_FOV_Y,
    up: ArrayLike = AXES[DEFAULT_UP],
    azimuth: float = DEFAULT_AZIMUTH,
    elevation: float | None = None,
    zoom: float = 1.0,
    over_poles: bool = False,
) -> list[Camera]:
    """One turn around the subject of a scene: a loop at constant distance, in even steps.

    The first camera looks in the direction of `frame_scene`, from the same distance or farther: as far as is
    needed to show the whole subject, with the same margin, in every view of the turn.

    Args:
        gaussians: N Gaussians, N >= 1.
        num_frames: >= 1; frame i is turned by i / num_frames of a full turn.
        width: pixels.
        height: pixels.
        fov_y: vertical field of view, radians, in (0, pi).
        up: [3] direction that is up in the first picture, world axes, any length.
        azimuth: of the first view, radians, see `frame_scene`; it grows along the orbit.
        elevation: of the first view, radians; None for `default_elevation`.
        zoom: see `frame_scene`.
        over_poles: the elevation grows by a full turn in place of the azimuth: straight over both poles of
            the up axis. The camera never rolls, so on the far side the world is upside down.

    Raises:
        ValueError: as `frame_scene` does, or if `num_frames` is below 1.
    """
    if num_frames < 1:
        raise ValueError(f"orbit: num_frames must be at least 1, got {num_frames}")
    framed = frame_scene(  # checks the arguments, and gives the lens
        gaussians,
        width=width,
        height=height,
        fov_y=fov_y,
        up=up,
        azimuth=azimuth,
        elevation=elevation,
        zoom=zoom,
    )
    up = np.asarray(up, dtype=np.float64)
    points, _ = subject(gaussians)
    if elevation is None:
        elevation = default_elevation(points, up)
    level = camera_axes(up, 0.0, 0.0)
    seen = points @ level.T
    center = 0.5 * (seen.min(axis=0) + seen.max(axis=0)) @ level
    axes = camera_axes(up, azimuth, elevation)
    # Circles start in a direction that moves with the camera: the fit does not depend on the first azimuth.
    axis, beside = (axes[0], axes[2]) if over_poles else (level[1], axes[0])
    swept = _swept(points - center, axis, beside) @ axes.T
    eye, distance = fit_eye(swept, np.tan(0.5 * fov_y) * np.array([width / height, 1.0]))
    eye[1 if over_poles else 0] = 0.0  # exactly in front of the axis: the fit has rounding errors
    cameras = []
    for index in range(num_frames):
        turn = 2 * np.pi * (index / num_frames)
        around = (azimuth, elevation + turn) if over_poles else (azimuth + turn, elevation)
        viewmat = np.eye(4)
        viewmat[:3, :3] = camera_axes(up, *around)
        viewmat[:3, 3] = -(eye + viewmat[:3, :3] @ center)
        cameras.append(Camera(viewmat, framed.K, width, height, near=NEAR_SHARE * distance))
    return cameras


def _swept(points: F64, axis: F64, beside: F64) -> F64:
    """[m, 3] points on the outline of the body that `points` [n, 3] sweep as they turn about `axis` [3].

    Both `axis` and `beside`, the perpendicular direction in which circles start, are unit vectors.
    """
    height = points @ axis
    radius = np.linalg.norm(points - height[:, None] * axis, axis=1)
    angles = np.linspace(-0.5 * np.pi, 0.5 * np.pi, _OUTLINE_STEPS)
    outermost = {int(np.argmax(np.cos(a) * radius + np.sin(a) * height)) for a in angles}
    rows = np.array(sorted(outermost))
    turns = 2 * np.pi * np.arange(_SWEEP_STEPS) / _SWEEP_STEPS
    circle = np.cos(turns)[:, None] * beside + np.sin(turns)[:, None] * np.cross(axis, beside)
    swept = radius[rows, None, None] * circle + (height[rows, None] * axis)[:, None]
    return np.asarray(swept.reshape(-1, 3))
