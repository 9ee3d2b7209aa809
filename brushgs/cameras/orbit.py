"""Cameras on a circle around the subject of a scene."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from brushgs.cameras.around import on_axis, subject_ahead, turned
from brushgs.cameras.framing import (
    DEFAULT_FOV_Y,
    NEAR_SHARE,
    LookAt,
    angles_of,
    aside,
    camera_axes,
    distance_ahead,
    eye_before,
    first_view_of,
    fit_eye,
    frame_scene,
    point_of,
    points_of,
    rolled,
)
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians

SWAY = 0.05  # radius of the circle of a camera inside a scene, over its distance to the target
_SWEEP_STEPS = 64  # samples of the circle of each outline point: error 0.1 % of its radius
_OUTLINE_STEPS = 181  # directions for finding outermost points


def orbit(
    scene: Gaussians | FirstView,
    num_frames: int,
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
    over_poles: bool = False,
) -> list[Camera]:
    """One turn around the subject of a scene: a loop at constant distance, in even steps.

    The first camera looks in the direction of `frame_scene`, from the distance needed to show the whole
    subject, with the same margin, in every view. The right axes are perpendicular to the up axis, so the
    horizon is level unless rolled.

    For a scene seen from inside, the camera sways on a small circle instead, see `sway`, unless `look_at`
    requests views from outside.

    Args:
        scene: N Gaussians, N >= 1, or the first view of a scene, see `frame_scene`.
        num_frames: >= 1; frame i is turned by i / num_frames of a full turn.
        width: pixels.
        height: pixels.
        fov_y: vertical field of view, radians, in (0, pi).
        up: [3] up direction of the first picture, world axes, any length; None for that of the first view.
        azimuth: of the first view, radians, see `frame_scene`; it grows along the orbit.
        elevation: of the first view, radians; None for that of `frame_scene`.
        zoom: see `frame_scene`.
        look_at: see `frame_scene`; the orbit is around its middle.
        distance: see `frame_scene`.
        pan: see `frame_scene`.
        roll: see `frame_scene`.
        over_poles: turn the elevation in place of the azimuth, over both poles of the up axis. The camera
            never rolls, so on the far side the world is upside down.

    Raises:
        ValueError: as `frame_scene` does, or if `num_frames` is below 1.
    """
    if num_frames < 1:
        raise ValueError(f"orbit: num_frames must be at least 1, got {num_frames}")
    view = first_view_of(scene, up)
    azimuth, elevation = angles_of(view, azimuth, elevation)
    framed = frame_scene(  # checks the arguments, and gives the lens
        view,
        width=width,
        height=height,
        fov_y=fov_y,
        azimuth=azimuth,
        elevation=elevation,
        zoom=zoom,
        look_at=look_at,
        distance=distance,
        pan=pan,
        roll=roll,
    )
    if view.eye is not None and look_at is None:
        return sway(framed, view, num_frames, roll=roll)
    points = points_of(view, look_at)
    level, center = camera_axes(view.up, 0.0, 0.0), middle_of(points, view.up)
    upright = camera_axes(view.up, azimuth, elevation)
    axes = rolled(upright, roll)
    # Circles start in a direction fixed to the camera, so that the fit does not depend on the first azimuth.
    axis, beside = (upright[0], upright[2]) if over_poles else (level[1], upright[0])
    swept = _swept(points - center, axis, beside) @ axes.T
    eye, away = fit_eye(swept, np.tan(0.5 * fov_y) * np.array([width / height, 1.0]))
    if roll == 0:
        eye[1 if over_poles else 0] = 0.0  # exactly in front of the axis: the fit has rounding errors
    if (point := point_of(look_at)) is not None:
        center = point
        eye, away = eye_before(np.zeros(3), away if distance is None else distance)
    eye = eye + aside(pan, framed.K, away)
    cameras = []
    for index in range(num_frames):
        turn = 2 * np.pi * (index / num_frames)
        around = (azimuth, elevation + turn) if over_poles else (azimuth + turn, elevation)
        viewmat = np.eye(4)
        viewmat[:3, :3] = rolled(camera_axes(view.up, *around), roll)
        viewmat[:3, 3] = -(eye + viewmat[:3, :3] @ center)
        cameras.append(Camera(viewmat, framed.K, width, height, near=NEAR_SHARE * away))
    return cameras


def middle_of(points: F64, up: F64) -> F64:
    """[3] middle of the bounds of points [n, 3] along level axes, the center of `orbit`."""
    level = camera_axes(up, 0.0, 0.0)
    seen = points @ level.T
    return np.asarray(0.5 * (seen.min(axis=0) + seen.max(axis=0)) @ level)


def sway(camera: Camera, view: FirstView, num_frames: int, *, roll: float = 0.0) -> list[Camera]:
    """A loop of a camera inside a scene: a small circle from its position, with a level horizon.

    It looks at a fixed point in the middle of the view ahead; the radius is `SWAY` times the distance to it.
    Strokes move against each other, and unphotographed parts stay hidden.

    Args:
        camera: the view from inside.
        view: the scene.
        num_frames: >= 1.
        roll: of `camera`, radians, see `frame_scene`.
    """
    distance = distance_ahead(view, camera.viewmat[:3, :3])
    right, down, forward = rolled(camera.viewmat[:3, :3], -roll)
    target = camera.position + distance * forward
    cameras = []
    for index in range(num_frames):
        turn = 2 * np.pi * (index / num_frames)
        offset = np.sin(turn) * right - (1 - np.cos(turn)) * down
        eye = camera.position + SWAY * distance * offset
        upright = Camera.look_at(eye, target, view.up, width=camera.width, height=camera.height)
        viewmat = np.eye(4)
        viewmat[:3, :3] = rolled(upright.viewmat[:3, :3], roll)
        viewmat[:3, 3] = -viewmat[:3, :3] @ eye
        cameras.append(replace(camera, viewmat=viewmat))
    return cameras


def pivot_of(view: FirstView, camera: Camera, look_at: LookAt | None = None) -> F64:
    """[3] the point about which a camera sways: on its axis, as far away as its framing target."""
    if view.eye is None or look_at is not None:
        return subject_ahead(camera, view, look_at)
    return on_axis(camera, distance_ahead(view, camera.viewmat[:3, :3]))


def swing(camera: Camera, center: ArrayLike, up: ArrayLike, num_frames: int, angle: float) -> list[Camera]:
    """A loop of a camera that swings about a point: to one side, to the other, and back.

    Args:
        camera: the first view.
        center: [3] any point of the axis, world units.
        up: [3] direction of the axis, any length > 0.
        num_frames: >= 1.
        angle: to each side, radians.
    """
    turns = angle * np.sin(2 * np.pi * np.arange(num_frames) / num_frames)
    return [turned(camera, center, up, float(turn)) for turn in turns]


def _swept(points: F64, axis: F64, beside: F64) -> F64:
    """[m, 3] outline of the body swept by `points` [n, 3] rotating about `axis` [3].

    `axis` and `beside`, a perpendicular direction in which circles start, are unit vectors.
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
