"""The cameras of glTF models, as Blender exports them: views, or the frames of an animated camera.

Cameras look along -z with y up. glTF knows no pixels and no frame rate, only seconds.
Source: Khronos, glTF 2.0 Specification, sections 3.10 and 3.11.
"""

from functools import partial
from pathlib import Path

import numpy as np

from brushgs.errors import SceneError
from brushgs.io.cameras.animated import FoundCamera, FoundScene, LensTrack, Times, camera_file
from brushgs.io.cameras.camera_file import CameraFile
from brushgs.io.cameras.gltf_channels import CameraModel, Channel, Channels, Perspective, read_channels
from brushgs.io.gltf_file import (
    AT_REST,
    CURE,
    GltfFile,
    PlacedNode,
    local_matrix,
    node_at,
    node_part,
    placed_nodes,
)
from brushgs.io.scene_node import is_scene_name
from brushgs.options.painting import DEFAULT_SIZE
from brushgs.values.arrays import F64
from brushgs.values.quats import rotation_matrices

_MIN_ANGLE = 1e-6  # radians


def read(path: Path, content: object = None) -> CameraFile:
    """The cameras of a model; see `animated.camera_file`.

    Args:
        path: a .glb or .gltf file.
        content: unused; it is for formats that are recognised as JSON.

    Raises:
        SceneError: if it is damaged, or holds no camera that can be drawn.
    """
    file = GltfFile(path, CameraModel, "camera file")
    nodes = list(placed_nodes(file))
    cameras = [some for some in nodes if some.node.camera is not None]
    scenes = [some for some in nodes if is_scene_name(some.node.name)][:1]
    channels = read_channels(file, {index for some in cameras + scenes for index in some.chain})
    scene = None
    if scenes:
        times = _times(_above(scenes[0], channels))
        scene = FoundScene(times, partial(_matrices, file, scenes[0], channels))
    found = [(some, *_lens(file, some)) for some in cameras]
    left_out = [name for _, name, lens in found if lens is None]
    kept = [_camera(file, some, name, lens, channels) for some, name, lens in found if lens is not None]
    return camera_file(path, kept, scene, None, left_out)


def _times(channels: list[Channel]) -> Times | None:
    """From the first key to the last of those that move."""
    moving = [channel.times for channel in channels if channel.is_moving]
    if not moving:
        return None
    return min(float(times[0]) for times in moving), max(float(times[-1]) for times in moving)


def _above(some: PlacedNode, channels: Channels) -> list[Channel]:
    """The channels that move a node, its own and those of the nodes above it."""
    return [channel for index in some.chain for channel in channels.get(("node", index), {}).values()]


def _lens(file: GltfFile[CameraModel], some: PlacedNode) -> tuple[str, Perspective | None]:
    """The name of a camera in words, and its lens; None of one without perspective."""
    index = some.node.camera
    camera = file.item(file.top.cameras, index, "a node refers to cameras")
    own_name = camera.name if some.node.name is None else some.node.name
    name = f"camera {own_name[:60]!r}" if isinstance(own_name, str) else f"camera {index}"
    return name, camera.perspective if camera.type == "perspective" else None


def _camera(
    file: GltfFile[CameraModel], some: PlacedNode, name: str, lens: Perspective, channels: Channels
) -> FoundCamera:
    yfov, near = lens.yfov, lens.znear
    aspect = lens.aspect_ratio or DEFAULT_SIZE[0] / DEFAULT_SIZE[1]
    opening = channels.get(("camera", some.node.camera or 0), {}).get("yfov")

    def at(moments: F64) -> tuple[F64, LensTrack]:
        angles = np.full(len(moments), yfov) if opening is None else opening.at(file, moments)[:, 0]
        if not ((angles > _MIN_ANGLE) & (angles < np.pi)).all():
            fact = f"got {angles.min():g} to {angles.max():g}"
            raise SceneError(
                file.path, f"yfov of {name} must be above 0 and below half a turn, {fact}; {CURE}"
            )
        focal = 0.5 / np.tan(angles / 2)
        track = LensTrack(focal, np.zeros((len(moments), 2)), np.full(len(moments), near), aspect)
        return _matrices(file, some, channels, moments), track

    movers = _above(some, channels) + ([] if opening is None else [opening])
    return FoundCamera(name, _times(movers), at)


def _matrices(file: GltfFile[CameraModel], some: PlacedNode, channels: Channels, moments: F64) -> F64:
    """[T, 4, 4] world from node, at moments [T] in seconds."""
    matrices = np.tile(np.eye(4), (len(moments), 1, 1))
    with np.errstate(over="ignore", invalid="ignore"):
        for index in some.chain:
            matrices = matrices @ _local(file, index, channels, moments)
    if not np.isfinite(matrices).all():
        raise SceneError(file.path, f"its nodes scale beyond all numbers; {CURE}")
    return matrices


def _local(file: GltfFile[CameraModel], index: int, channels: Channels, moments: F64) -> F64:
    """[T, 4, 4] or [4, 4] of one node."""
    node = node_at(file, index)
    parts = channels.get(("node", index))
    if not parts:
        return local_matrix(file, index, node)
    if node.matrix is not None:
        raise SceneError(file.path, f"node {index} has a matrix, so it cannot be animated; {CURE}")
    quats, scale, translation = (
        parts[part].at(file, moments) if part in parts else node_part(node, part)[None] for part in AT_REST
    )
    if not quats.any(axis=1).all():
        raise SceneError(file.path, f"rotation of node {index} must not be zero; {CURE}")
    matrices = np.tile(np.eye(4), (len(moments), 1, 1))
    matrices[:, :3, :3] = rotation_matrices(quats[:, [3, 0, 1, 2]]) * scale[:, None, :]
    matrices[:, :3, 3] = translation
    return matrices
