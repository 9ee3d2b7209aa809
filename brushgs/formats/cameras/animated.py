"""Convert still or animated cameras of 3D programs to views: the part common to their file formats.

These cameras look along -z with y up, under a tree of transforms that may scale; they have no size in pixels.
A node named `SCENE_NODE` gives the transform of the painted scene: views are converted to scene coordinates,
whatever rotated, moved or scaled the scene. Without this node, the file is in scene coordinates.
"""

import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
from msgspec import Meta

from brushgs.errors import SceneError, SceneWarning
from brushgs.formats.cameras.read import MAX_DISTANCE, CameraFile, Motion, camera_of
from brushgs.formats.gltf_file import SCENE_NODE
from brushgs.options.painting import DEFAULT_SIZE
from brushgs.options.sequence import DEFAULT_FPS
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera

MAX_VIEWS = 50_000  # per file: half an hour of film; a view takes some 1.2 kB in memory
MAX_ASPECT = 50.0  # width / height, or height / width
DEFAULT_ASPECT = DEFAULT_SIZE[0] / DEFAULT_SIZE[1]  # if a file states none
_UNIFORM = 1e-3  # relative difference of scales between axes that rounding may cause
_NEAR = 1 - 1e-9  # cosine above which quaternions are interpolated linearly: the sine of their angle vanishes
_CV_FROM_GL = np.diag([1.0, -1.0, -1.0])  # x right, y up, z backward -> x right, y down, z forward

Times = tuple[float, float]
_Coordinate = Annotated[float, Meta(ge=-MAX_DISTANCE, le=MAX_DISTANCE)]  # world units
Point = tuple[_Coordinate, _Coordinate, _Coordinate]
Quat = tuple[_Coordinate, _Coordinate, _Coordinate, _Coordinate]


class LensTrack(NamedTuple):
    """A lens at T times."""

    focal: F64  # [T] focal length, in picture heights
    center: F64  # [T, 2] principal point, right and down from the picture center, in picture heights
    near: F64  # [T] near plane, units of the file, > 0
    aspect: float  # width / height of the picture


class FoundCamera(NamedTuple):
    """A camera of a file."""

    name: str  # in words, such as "camera 'Shot'"
    times: Times | None  # start and end of its animation, seconds of the file; None if it is still
    # matrices [T, 4, 4], world of the file from camera, which may scale, and the lens, at times [T] in
    # seconds of the file
    at: Callable[[F64], tuple[F64, LensTrack]]


class FoundScene(NamedTuple):
    """The transform of the painted scene in a file; see `SCENE_NODE`."""

    times: Times | None  # start and end of its animation, seconds of the file; None if it is still
    # matrices [T, 4, 4], world of the file from scene, at times [T] in seconds of the file
    at: Callable[[F64], F64]


def camera_file(
    path: Path,
    cameras: list[FoundCamera],
    scene: FoundScene | None,
    fps: float | None,
    left_out: Sequence[str],
) -> CameraFile:
    """The frames of the first animated camera, or one view of each camera if nothing is animated.

    If only the painted scene is animated, the first camera gives the frames.

    Args:
        path: the file, for messages.
        cameras: the perspective cameras.
        scene: the painted scene, if the file has it.
        fps: frames a second, if the file states it.
        left_out: names of the other cameras, for a SceneWarning.

    Raises:
        SceneError: if there is no camera, a view cannot be drawn, or there are too many frames.
    """
    _check_found(path, cameras, left_out)
    moving = [camera for camera in cameras if camera.times is not None]
    chosen = (moving or cameras)[0]
    spans = [some.times for some in (chosen, scene) if some is not None and some.times is not None]
    start = min((span[0] for span in spans), default=0.0)
    seconds = max((span[1] for span in spans), default=0.0) - start
    if not seconds > 0:
        moment = np.array([start])
        return CameraFile([view for camera in cameras for view in _views(path, camera, scene, moment)])
    num_steps = seconds * (fps or DEFAULT_FPS)
    if num_steps >= MAX_VIEWS:
        fact = f"{chosen.name} moves for {seconds:,.0f} s, which is more than {MAX_VIEWS:,} frames"
        raise SceneError(path, f"{fact}; export a part of it")
    motion = Motion(seconds, lambda moments: _views(path, chosen, scene, start + moments))
    which = {0: "the", 1: "the animated"}.get(len(moving), f"the first of {len(moving)} animated cameras,")
    choice = f"{which} {chosen.name} of {len(cameras)}" if len(cameras) > 1 else ""
    return CameraFile(motion.views(max(round(num_steps), 1) + 1), fps=fps, motion=motion, choice=choice)


def _check_found(path: Path, cameras: list[FoundCamera], left_out: Sequence[str]) -> None:
    """Refuse a file without a perspective camera, and warn of other cameras."""
    if not cameras:
        fact = f"{left_out[0]} must be a perspective one; export it again as such" if left_out else ""
        raise SceneError(path, fact or "holds no camera; export it with its cameras")
    if left_out:
        message = f"{left_out[0]} is no perspective one and was left out"
        more = f", as were {len(left_out) - 1} more" if len(left_out) > 1 else ""
        warnings.warn(SceneWarning(f"{path}: {message}{more}"), stacklevel=5)


def _views(path: Path, found: FoundCamera, scene: FoundScene | None, times: F64) -> list[Camera]:
    """The views of a camera at times of the file, in scene coordinates."""
    matrices, lens = found.at(times)
    near = lens.near
    if scene is not None:
        world_from_scene = scene.at(times)
        shrink = _scale_of_scene(path, world_from_scene)
        with np.errstate(all="ignore"):
            matrices, near = np.asarray(np.linalg.solve(world_from_scene, matrices)), near / shrink
    rotations = _rotations(path, found.name, matrices)
    width, height = _picture_size(path, found.name, lens.aspect)
    views = []
    for index, rotation in enumerate(rotations):
        place, focal = matrices[index, :3, 3], lens.focal[index] * height
        cx, cy = np.array([width, height]) / 2 + lens.center[index] * height
        if not np.isfinite([focal, cx, cy, near[index], *place]).all():
            raise SceneError(path, f"{found.name} has numbers that are not finite; export it again")
        K = focal, focal, cx, cy
        try:
            views.append(camera_of(rotation.T, -rotation.T @ place, K, (width, height), near[index]))
        except ValueError as error:
            raise SceneError(path, f"{found.name}: {error}; export it again") from None
    return views


def _rotations(path: Path, name: str, matrices: F64) -> F64:
    """Rotations [T, 3, 3] of matrices [T, 4, 4], without scale and with the axes of `Camera`."""
    with np.errstate(all="ignore"):
        axes = matrices[:, :3, :3] / np.linalg.norm(matrices[:, :3, :3], axis=1, keepdims=True)
    if not np.isfinite(axes).all():
        raise SceneError(path, f"{name} is scaled to nothing or beyond all numbers; export it without scale")
    left, _, right = np.linalg.svd(axes)
    turns = left @ right
    if (np.linalg.det(turns) < 0).any():
        raise SceneError(path, f"{name} is mirrored by what it hangs on; export it without negative scale")
    return np.asarray(turns @ _CV_FROM_GL)


def _scale_of_scene(path: Path, matrices: F64) -> F64:
    """[T] units of the file per unit of the scene."""
    if np.isfinite(matrices).all():
        stretch = np.linalg.svd(matrices[:, :3, :3], compute_uv=False)
        is_uniform = (stretch[:, 2] > 1 / MAX_DISTANCE) & (stretch[:, 0] <= (1 + _UNIFORM) * stretch[:, 2])
        if is_uniform.all() and (np.linalg.det(matrices[:, :3, :3]) > 0).all():
            return np.asarray(stretch.mean(axis=1))
    raise SceneError(
        path, f"node {SCENE_NODE!r} must be scaled equally along all axes and not mirrored; apply its scale"
    )


def _picture_size(path: Path, name: str, aspect: float) -> tuple[int, int]:
    """Width and height in pixels: the default longest side, and even numbers, as videos require."""
    if not 1 / MAX_ASPECT <= aspect <= MAX_ASPECT:
        rule = f"the aspect ratio must be {1 / MAX_ASPECT:g} to {MAX_ASPECT:g}, got {aspect:g}"
        raise SceneError(path, f"{name}: {rule}; export it again")
    longest = max(DEFAULT_SIZE)
    width, height = longest * min(1.0, aspect), longest * min(1.0, 1 / aspect)
    return 2 * round(width / 2), 2 * round(height / 2)


def steered(turns: F64, places: F64, focal: F64, scene_from_world: F64) -> tuple[F64, LensTrack]:
    """The result of `FoundCamera.at` for an editor that has only poses and focal lengths.

    Args:
        turns: [T, 3, 3] rotations, world of the editor from camera.
        places: [T, 3] positions in the world of the editor.
        focal: [T] see `LensTrack`.
        scene_from_world: [3, 3] axes of the scene from the axes of the editor.
    """
    matrices = np.tile(np.eye(4), (len(places), 1, 1))
    matrices[:, :3, :3], matrices[:, :3, 3] = turns, places
    matrices[:, :3] = scene_from_world @ matrices[:, :3]
    near = np.full(len(places), Camera.near)
    return matrices, LensTrack(focal, np.zeros((len(places), 2)), near, DEFAULT_ASPECT)


def hermite(start: F64, leave: F64, arrive: F64, end: F64, share: F64) -> F64:
    """Cubic Hermite interpolation, [T, D]; `share` is [T, 1] and velocities are per unit of share."""
    t2, t3 = share**2, share**3
    at_start = (2 * t3 - 3 * t2 + 1) * start + (t3 - 2 * t2 + share) * leave
    return np.asarray(at_start + (3 * t2 - 2 * t3) * end + (t3 - t2) * arrive)


def slerp(first: F64, second: F64, share: F64) -> F64:
    """Spherical linear interpolation of unit quaternions [T, 4] along the shorter arc; shares are [T, 1]."""
    cosine = np.sum(first * second, axis=1, keepdims=True)
    second, cosine = np.where(cosine < 0, -second, second), np.abs(cosine)
    angle = np.arccos(np.minimum(cosine, _NEAR))
    turned = (np.sin((1 - share) * angle) * first + np.sin(share * angle) * second) / np.sin(angle)
    return np.asarray(np.where(cosine > _NEAR, first + share * (second - first), turned))
