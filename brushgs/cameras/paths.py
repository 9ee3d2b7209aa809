"""Camera paths from options: an orbit around the scene, or the views of a file, with `spline` between them.

A loop of N frames has N different views, 1/N of its length apart; frame N would equal frame 0 and is omitted.
Its frames are every second one of 2 N, so the frame rate does not change the path. An open path includes both
ends: its N frames are every second one of 2 N - 1.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from brushgs.cameras.around import turned
from brushgs.cameras.first_view import framed_camera, framed_orbit
from brushgs.cameras.framing import NEAR_SHARE
from brushgs.cameras.motion import is_same_view
from brushgs.cameras.orbit import pivot_of, swing
from brushgs.cameras.spline import through
from brushgs.errors import SceneError
from brushgs.formats.cameras.read import CameraFile
from brushgs.options.choices import file_size_rule
from brushgs.options.painting import ViewConfig
from brushgs.options.sequence import DEFAULT_FPS, MAX_FPS, MAX_FRAMES, PathConfig
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera, FirstView


@dataclass(frozen=True)
class _Ball:
    """Bounding ball of the subject: center [3] and radius, world units."""

    center: F64
    radius: float


@dataclass(frozen=True)
class CameraPath:
    """The views of a sequence, all of one size.

    Attributes:
        cameras: one per frame, at least one. A loop does not repeat its first view at the end.
        is_loop: whether the first view follows the last.
        fps: frames per second, > 0.
        source: origin of the path in words, for the report.
    """

    cameras: list[Camera]
    is_loop: bool
    fps: float
    source: str

    @property
    def closed(self) -> list[Camera]:
        """The cameras for tracking: a loop ends with its first view again."""
        return [*self.cameras, self.cameras[0]] if self.is_loop else self.cameras


def standing(camera: Camera, num_frames: int, fps: float) -> CameraPath:
    """The path of a fixed camera."""
    return CameraPath([camera] * num_frames, False, fps, "one view")


def plan_path(first_view: FirstView | None, view: ViewConfig, path: PathConfig) -> CameraPath:
    """The camera path of options.

    Args:
        first_view: of the scene, for distances; None for a scene without Gaussians.
        view: framing of an orbit, and size of the pictures. For a path from a file only `size` is used; None
            takes the size of the file's first camera.
        path: see `PathConfig`.

    Raises:
        ValueError: if `view` has a camera file, or an orbit has no subject.
        SceneError: if the file cannot be read, or holds too few different views for a curve.
    """
    if view.camera_file is not None:
        raise ValueError("camera-file cannot be combined with a camera path, which places the cameras")
    if path.orbit is None:
        return _file_path(first_view, view, path)
    if first_view is None:
        raise ValueError("orbit: the scene must have at least one Gaussian, got none")
    fps = path.fps or DEFAULT_FPS
    photograph = first_view.photograph if view.look_at is None and view.side is None else None
    angle = path.sway
    if angle is None and photograph is not None:
        angle = photograph.cone
    if angle is not None:
        camera = framed_camera(first_view, view)
        pivot = pivot_of(first_view, camera, view.look_at) if photograph is None else photograph.pivot
        cameras = swing(camera, pivot, first_view.up, path.orbit, angle)
        return CameraPath(cameras, True, fps, f"a sway of {np.degrees(angle):.3g} degrees to each side")
    cameras = framed_orbit(first_view, view, path.orbit)
    if first_view.eye is not None and view.look_at is None and view.side is None:
        source = f"a small circle in {path.orbit} steps, inside the scene"
    else:
        source = f"one turn in steps of {360 / path.orbit:g} degrees"
    return CameraPath(cameras, True, fps, source)


def path_through(
    keys: list[Camera],
    first_view: FirstView | None,
    *,
    size: tuple[int, int],
    seconds: float,
    fps: float = DEFAULT_FPS,
    loop: bool = False,
) -> CameraPath:
    """A smooth path through key views, at constant speed.

    Args:
        keys: of any sizes.
        first_view: of the scene, for distances.
        size: (width, height) of the pictures.
        seconds: duration, > 0.
        fps: frames per second, > 0.
        loop: whether the path continues from the last view to the first.

    Raises:
        ValueError: if fewer than two views differ, or three for a loop; or for 100,000 frames or more.
    """
    ball, num_frames = _ball_of(first_view), _num_frames(seconds, fps, loop)
    cameras = _fitted(keys, size, ball)
    frames = through(cameras, num_frames, center=ball.center, reach=ball.radius, loop=loop)
    return CameraPath(frames, loop, fps, f"a curve through {len(keys)} key views")


def turn_around(
    camera: Camera, center: ArrayLike, up: ArrayLike, *, seconds: float, fps: float = DEFAULT_FPS
) -> CameraPath:
    """One turn of a camera around a point, a loop from its position; to its right, like `orbit`.

    Args:
        camera: the first view.
        center: [3] any point of the axis, world units.
        up: [3] direction of the axis, any length > 0.
        seconds: duration, > 0.
        fps: frames per second, > 0.

    Raises:
        ValueError: for 100,000 frames or more.
    """
    num_frames = max(_num_frames(seconds, fps, True), 3)
    turns = (2 * np.pi * (index / num_frames) for index in range(num_frames))
    cameras = [turned(camera, center, up, turn) for turn in turns]
    return CameraPath(cameras, True, fps, f"one turn in steps of {360 / num_frames:g} degrees")


def _file_path(first_view: FirstView | None, view: ViewConfig, path: PathConfig) -> CameraPath:
    from brushgs.formats.cameras.read import read_cameras

    assert path.file is not None
    file = read_cameras(path.file)
    is_loop, fps = path.loop or file.is_loop, path.fps or file.fps or DEFAULT_FPS
    if fps > MAX_FPS:
        raise SceneError(path.file, f"says {fps:g} frames a second, above {MAX_FPS:g}; give --fps")
    ball, size = _ball_of(first_view), view.fixed_size or _size_of(path.file, file.cameras[0])
    cameras = _fitted(_views_of(file, path, fps), size, ball)
    of_file = f"{path.file.name}{file.choice and ', ' + file.choice}"
    if file.motion is not None or not (path.frames or path.seconds):
        if is_loop and len(cameras) > 1 and is_same_view(cameras[-1], cameras[0], ball.radius):
            cameras.pop()
        return CameraPath(cameras, is_loop, fps, f"{len(cameras)} views of {of_file}")
    num_frames = path.frames or _num_frames(path.seconds or 0.0, fps, is_loop)
    try:
        frames = through(cameras, num_frames, center=ball.center, reach=ball.radius, loop=is_loop)
    except ValueError as error:
        raise SceneError(path.file, f"{error}; omit frames and seconds to paint its views") from None
    return CameraPath(frames, is_loop, fps, f"a curve through {len(cameras)} key views of {of_file}")


def _views_of(file: CameraFile, path: PathConfig, fps: float) -> list[Camera]:
    """The views that a path takes from a file: moments of its motion, key views of a curve, or all."""
    if file.motion is not None and (path.frames or path.seconds or path.fps):
        # Continuous motion: another rate or duration samples other moments.
        if path.frames:  # of a loop its caller leaves out the last, which is the first again
            return file.motion.views(path.frames + file.is_loop)
        return file.motion.views(_num_frames(path.seconds or file.motion.seconds, fps, False))
    is_curve = path.frames or path.seconds
    return file.keys if is_curve and len(file.keys) > 1 else file.cameras


def _size_of(path: Path, first: Camera) -> tuple[int, int]:
    """The size of a file's first camera. Raises SceneError if it is too large."""
    if broken := file_size_rule(first.width, first.height):
        raise SceneError(path, broken)
    return first.width, first.height


def _num_frames(seconds: float, fps: float, is_loop: bool) -> int:
    """Number of frames of a duration; an open path has one more, as both its ends are frames."""
    num_steps = round(min(seconds * fps, 2.0 * MAX_FRAMES))
    if not 1 <= num_steps < MAX_FRAMES:
        raise ValueError(f"seconds times fps must give 1 to {MAX_FRAMES} frames, got {seconds * fps:g}")
    return num_steps + (not is_loop)


def _ball_of(first_view: FirstView | None) -> _Ball:
    """The ball of the subject; the unit ball at the origin without one."""
    if first_view is None:
        return _Ball(np.zeros(3), 1.0)
    low, high = first_view.points.min(axis=0), first_view.points.max(axis=0)
    return _Ball(0.5 * (low + high), 0.5 * float((high - low).max()) or 1e-9)


def _fitted(cameras: list[Camera], size: tuple[int, int], ball: _Ball) -> list[Camera]:
    """Cameras of a file in one size, with a common near plane.

    The default near plane, 0.01, is that of training; it is lowered only for small scenes.
    """
    distance = float(np.median([np.linalg.norm(camera.position - ball.center) for camera in cameras]))
    near = min(cameras[0].near, NEAR_SHARE * max(distance, ball.radius))
    same_size = [c if (c.width, c.height) == size else c.resized(*size) for c in cameras]
    return [replace(camera, near=near) for camera in same_size]
