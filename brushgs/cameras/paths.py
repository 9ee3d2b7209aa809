"""Camera paths: around a scene, or as a file says. A path is a list of cameras; `spline` has the curves.

A loop of N frames has N different views, 1/N of the way apart; frame N would be frame 0 and is left
out. So N frames are every second one of 2 N frames: the frame rate does not change the way. An open
path of N frames begins and ends at its ends: its frames are every second one of 2 N - 1.
"""

from dataclasses import dataclass, replace

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
    direction_of,
    fit_eye,
    frame_scene,
    subject,
)
from brushgs.cameras.motion import view_changes
from brushgs.cameras.spline import SAME_VIEW, through
from brushgs.errors import SceneError
from brushgs.options.choices import file_size_rule
from brushgs.options.painting import DEFAULT_SIZE, ViewConfig
from brushgs.options.sequence import DEFAULT_FPS, MAX_FPS, MAX_FRAMES, PathConfig
from brushgs.scene import Camera, Gaussians

_SWEEP_STEPS = 64  # of the turn that the subject makes past the camera: 0.1 % of its radius is missed
_OUTLINE_STEPS = 181  # directions in which the outermost points are looked for


@dataclass(frozen=True)
class CameraPath:
    """The views of a sequence, all of one size.

    Attributes:
        cameras: one per frame, at least one. A loop does not repeat its first view at the end.
        is_loop: whether the view after the last is the first again.
        fps: frames a second, > 0.
        source: in words, where the path is from, for the report.
    """

    cameras: list[Camera]
    is_loop: bool
    fps: float
    source: str

    @property
    def closed(self) -> list[Camera]:
        """The cameras for whoever follows strokes along them: a loop ends with its first view again."""
        return [*self.cameras, self.cameras[0]] if self.is_loop else self.cameras


def plan_path(
    gaussians: Gaussians, view: ViewConfig, path: PathConfig, *, file_up: str | None = None
) -> CameraPath:
    """The path that is asked for.

    Args:
        gaussians: the scene as loaded; says where the subject is.
        view: of an orbit, how the scene is framed, and the size of the pictures. Of a path from a file
            only `size` is used; where it is None pictures have the size of the file's first camera.
        path: see `PathConfig`.
        file_up: the up axis that the header of the scene file states, if it does.

    Raises:
        ValueError: if `view` names a camera file: a path says by itself where the cameras are.
        SceneError: if the file cannot be read, or holds fewer than two views to go between.
    """
    if view.camera_file is not None:
        raise ValueError("camera-file cannot be combined with a camera path, which places the cameras")
    return _orbit(gaussians, view, path, file_up) if path.file is None else _from_file(gaussians, view, path)


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

    The first camera looks in the direction of `frame_scene`, from the same distance or farther: as far
    as is needed to hold the subject whole, with the same margin, in every view of the turn.

    Args:
        gaussians: N Gaussians, N >= 1.
        num_frames: >= 1; frame i is turned by i / num_frames of a full turn.
        width: pixels.
        height: pixels.
        fov_y: vertical field of view, radians, in (0, pi).
        up: [3] direction that is up in the first picture, world axes, any length.
        azimuth: of the first view, radians, see `frame_scene`; it grows along the way.
        elevation: of the first view, radians; None for `default_elevation`.
        zoom: see `frame_scene`.
        over_poles: in place of the azimuth the elevation grows by a full turn: straight over both
            poles of the up axis. The picture turns with the camera, so it never spins; on the far
            side, between the poles, the world hangs upside down.

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
    # The rows beside the axis move with the camera: the fit is the same from wherever the turn begins.
    axis, beside = (axes[0], axes[2]) if over_poles else (level[1], axes[0])
    swept = _swept(points - center, axis, beside) @ axes.T
    eye, distance = fit_eye(swept, np.tan(0.5 * fov_y) * np.array([width / height, 1.0]))
    eye[1 if over_poles else 0] = 0.0  # exactly before the axis; the fit finds it to rounding
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
    """[m, 3] points on the outline of what `points` [n, 3] pass through as they turn about `axis` [3].

    Both `axis` and the direction `beside` it, in which the circles are begun, are unit vectors.
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


def _orbit(gaussians: Gaussians, view: ViewConfig, path: PathConfig, file_up: str | None) -> CameraPath:
    assert path.orbit is not None
    up = view.up or file_up or DEFAULT_UP
    width, height = view.size or DEFAULT_SIZE
    cameras = orbit(
        gaussians,
        path.orbit,
        width=width,
        height=height,
        fov_y=view.fov_y,
        up=direction_of(up),
        azimuth=view.azimuth,
        elevation=view.elevation,
        zoom=view.zoom,
    )
    axis = up if isinstance(up, str) else ",".join(f"{x:g}" for x in up)
    known = "as asked" if view.up else "as its header says" if file_up else "assumed, change it with --up"
    source = f"one turn in steps of {360 / path.orbit:g} degrees; up is {axis} ({known})"
    return CameraPath(cameras, True, path.fps or DEFAULT_FPS, source)


def _from_file(gaussians: Gaussians, view: ViewConfig, path: PathConfig) -> CameraPath:
    from brushgs.io.cameras.read import read_cameras

    assert path.file is not None
    file = read_cameras(path.file)
    is_loop, fps = path.loop or file.is_loop, path.fps or file.fps or DEFAULT_FPS
    if fps > MAX_FPS:
        raise SceneError(path.file, f"says {fps:g} frames a second, above {MAX_FPS:g}; give --fps")
    is_curve = path.frames is not None or path.seconds is not None
    views = file.keys if is_curve and len(file.keys) > 1 else file.cameras
    ball = _ball(gaussians)
    first = file.cameras[0]
    if view.size is None and (broken := file_size_rule(first.width, first.height)):
        raise SceneError(path.file, broken)
    cameras = _fitted(views, view.size or (first.width, first.height), ball)
    if not is_curve:
        if is_loop and len(cameras) > 1 and _is_same(cameras[-1], cameras[0], ball):
            cameras.pop()
        return CameraPath(cameras, is_loop, fps, f"{len(cameras)} views of {path.file.name}")
    num_frames = path.frames or _num_frames(path.seconds or 0.0, fps, is_loop)
    center, reach = ball or (np.zeros(3), 1.0)
    try:
        frames = through(cameras, num_frames, center=center, reach=reach, loop=is_loop)
    except ValueError as error:
        raise SceneError(path.file, f"{error}; give neither frames nor seconds to draw its views") from None
    return CameraPath(frames, is_loop, fps, f"a curve through {len(cameras)} key views of {path.file.name}")


def _num_frames(seconds: float, fps: float, is_loop: bool) -> int:
    """Frames of a duration; an open path has one more, so that both its ends are frames."""
    num_steps = round(min(seconds * fps, 2.0 * MAX_FRAMES))
    if not 1 <= num_steps < MAX_FRAMES:
        raise ValueError(f"seconds times fps must give 1 to {MAX_FRAMES} frames, got {seconds * fps:g}")
    return num_steps + (not is_loop)


def _ball(gaussians: Gaussians) -> tuple[F64, float] | None:
    """Middle and half size of the subject; None where there is nothing."""
    if len(gaussians) == 0:
        return None
    points, _ = subject(gaussians)
    low, high = points.min(axis=0), points.max(axis=0)
    return 0.5 * (low + high), max(0.5 * float((high - low).max()), 1e-9)


def _fitted(cameras: list[Camera], size: tuple[int, int], ball: tuple[F64, float] | None) -> list[Camera]:
    """Cameras of a file in one size, with one near plane that suits the scene.

    The default near plane, 0.01, is what trained scenes were drawn with; it comes nearer only where the
    whole scene is small.
    """
    near = cameras[0].near
    if ball is not None:
        distance = float(np.median([np.linalg.norm(camera.position - ball[0]) for camera in cameras]))
        near = min(near, NEAR_SHARE * max(distance, ball[1]))
    same_size = [c if (c.width, c.height) == size else c.resized(*size) for c in cameras]
    return [replace(camera, near=near) for camera in same_size]


def _is_same(first: Camera, second: Camera, ball: tuple[F64, float] | None) -> bool:
    distance = 1.0 if ball is None else ball[1]
    return bool(view_changes(first.viewmat[None], second.viewmat[None], distance)[0] < SAME_VIEW)
