"""The cameras of glTF models, as Blender exports them: views, or the frames of an animated camera.

Cameras look along -z with y up. glTF has times in seconds, but no picture size and no frame rate. All
animations are played together, because exporters write one for each object; if two animate the same part of
a node, the first is used.
Source: Khronos, glTF 2.0 Specification, sections 3.10 and 3.11, and appendix C.
"""

import re
from collections.abc import Container
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from msgspec import Meta, Struct, field
from numpy.typing import NDArray

from brushgs.errors import SceneError
from brushgs.formats.cameras import animated
from brushgs.formats.cameras.animated import FoundCamera, LensTrack
from brushgs.formats.cameras.read import CameraFile
from brushgs.formats.gltf_file import CURE, GltfArray, GltfFile, Index, Model, PlacedNode
from brushgs.values.arrays import F64

_WIDTHS = {"translation": 3, "rotation": 4, "scale": 3, "yfov": 1}
# A part of a node, or of a camera, that is animated through KHR_animation_pointer.
_POINTER = re.compile(
    "/(node)s/([0-9]{1,9})/(translation|rotation|scale)|/(camera)s/([0-9]{1,9})/perspective/(yfov)"
)
Interpolation = Literal["LINEAR", "STEP", "CUBICSPLINE"]
_MIN_ANGLE = 1e-6  # radians
_MAX_KEYS = 4_000_000  # keyframes of all channels: hours at the rate of film
_MOST = 1e18  # products of a few larger numbers would overflow

Positive = Annotated[float, Meta(gt=0)]


class _Perspective(Struct, rename="camel"):
    yfov: Positive
    znear: Positive
    aspect_ratio: Positive | None = None


class _Camera(Struct):
    type: Any = None
    name: Any = None
    perspective: _Perspective | None = None


class _Pointer(Struct):  # KHR_animation_pointer
    pointer: str = ""  # JSON pointer to the property that a channel animates


class _Extensions(Struct):
    pointed: _Pointer | None = field(name="KHR_animation_pointer", default=None)


class _Target(Struct):
    node: Index | None = None
    path: Any = None
    extensions: _Extensions | None = None


class _StoredChannel(Struct):
    target: _Target
    sampler: Index


class _Sampler(Struct):
    input: Index
    output: Index
    interpolation: Interpolation = "LINEAR"


class _Animation(Struct):
    channels: list[_StoredChannel] | None = None
    samplers: list[_Sampler] | None = None


class _Model(Model):
    cameras: list[_Camera] | None = None
    animations: list[_Animation] | None = None


_File = GltfFile[_Model]


class Channel(NamedTuple):
    """One animated part of a node or camera."""

    times: F64  # [K] times of its keyframes, seconds, ascending
    values: GltfArray  # [K, width], or [3 K, width] for a cubic spline: in-tangent, value, out-tangent
    interpolation: Interpolation  # between keyframes
    is_rotation: bool  # whether values are quaternions x, y, z, w
    is_moving: bool  # whether values differ between keyframes
    name: str  # for messages

    def at(self, file: _File, moments: F64) -> F64:
        """Values [T, width] at times [T], seconds; times are clamped to the range of the keyframes.

        Raises SceneError if values are not finite or too large, or a rotation is zero.
        """
        is_spline = self.interpolation == "CUBICSPLINE"
        # Read one keyframe of a still channel: it may have very many, and be evaluated for many cameras.
        num_rows = self.values.count if self.is_moving else 1 + 2 * is_spline
        values = self.values.read(0, num_rows).astype(np.float64)
        if not (np.abs(values) < _MOST).all():  # also false for NaN
            raise SceneError(file.path, f"{self.name} must be finite, with values below 1e18; {CURE}")
        if not self.is_moving:
            found = np.repeat(values[[int(is_spline)]], len(moments), axis=0)
            return self._unit(file, found) if self.is_rotation else found
        last = len(self.times) - 1
        before = np.clip(np.searchsorted(self.times, moments, side="right") - 1, 0, last - 1)
        length = (self.times[before + 1] - self.times[before])[:, None]
        share = np.clip((moments - self.times[before])[:, None] / length, 0, 1)
        if is_spline:
            found = _cubic(values, before, share, length)
        elif self.interpolation == "STEP":
            found = np.where(share < 1, values[before], values[before + 1])
        elif self.is_rotation:
            values = self._unit(file, values)
            found = animated.slerp(values[before], values[before + 1], share)
        else:
            found = values[before] + share * (values[before + 1] - values[before])
        return self._unit(file, found) if self.is_rotation else found

    def _unit(self, file: _File, quats: F64) -> F64:
        lengths = np.linalg.norm(quats, axis=1, keepdims=True)
        if not (lengths > 0).all():
            raise SceneError(file.path, f"{self.name} must not be zero; {CURE}")
        return np.asarray(quats / lengths)


# ("node" or "camera", its number) -> part -> channel.
Channels = dict[tuple[str, int], dict[str, Channel]]


def read_channels(file: _File, nodes: Container[int]) -> Channels:
    """The channels of all animations that transform one of `nodes`, or change the field of view of a camera.

    Raises SceneError if one is damaged, or there are too many keyframes.
    """
    found: Channels = {}
    num_keys = 0
    for number, animation in enumerate(file.top.animations or []):
        for channel in animation.channels or []:
            target = _target(channel.target)
            if target is None or (target[0] == "node" and target[1] not in nodes):
                continue
            owner, index, part = target
            parts = found.setdefault((owner, index), {})
            if part in parts:
                continue
            name = f"{part} of {owner} {index} in animation {number}"
            parts[part] = _channel(file, animation, channel, part, name)
            num_keys += len(parts[part].times)
            if num_keys > _MAX_KEYS:
                raise SceneError(file.path, f"must have at most {_MAX_KEYS:,} keys; export a part of it")
    return found


def _target(target: _Target) -> tuple[str, int, str] | None:
    """The target of a channel: "node" or "camera", its number, the part; None if it is not used here."""
    if target.path != "pointer":
        moves = target.node is not None and target.path in ("translation", "rotation", "scale")
        return ("node", target.node or 0, target.path) if moves else None
    pointed = target.extensions.pointed if target.extensions else None
    if (found := _POINTER.fullmatch(pointed.pointer) if pointed else None) is None:
        return None
    owner, number, part = (group for group in found.groups() if group)
    return owner, int(number), part


def _channel(file: _File, animation: _Animation, channel: _StoredChannel, part: str, name: str) -> Channel:
    sampler = file.item(animation.samplers, channel.sampler, f"{name} refers to samplers")
    interpolation, width = sampler.interpolation, _WIDTHS[part]
    keys, values = file.array(sampler.input, f"the times of {name}"), file.array(sampler.output, name)
    if (keys.width, values.width) != (1, width):
        rule = f"{name} must have 1 number a time and {width} a value"
        raise SceneError(file.path, f"{rule}, got {keys.width} and {values.width}; {CURE}")
    rows = keys.count * (3 if interpolation == "CUBICSPLINE" else 1)
    if not 1 <= keys.count <= _MAX_KEYS or values.count != rows:
        rule = f"{name} must have 1 to {_MAX_KEYS:,} keys with as many values"
        raise SceneError(file.path, f"{rule}, got {keys.count} times and {values.count} values; {CURE}")
    times = keys.read(0, keys.count)[:, 0].astype(np.float64)
    if not np.isfinite(times).all() or (np.diff(times) <= 0).any():
        raise SceneError(file.path, f"the times of {name} must be finite and ascend; {CURE}")
    is_moving = _differ(values.values, interpolation) and keys.count > 1
    return Channel(times, values, interpolation, part == "rotation", is_moving, name)


def _differ(values: NDArray[Any], interpolation: str) -> bool:
    """Whether values change or a tangent is not zero; NaN counts as a change."""
    if interpolation != "CUBICSPLINE":
        return bool((values != values[0]).any())
    tangents = values[0::3], values[2::3]
    is_moving = any((one != 0).any() for one in tangents)  # `any` of a signaling NaN would warn
    return bool(is_moving or (values[1::3] != values[1]).any())


def _cubic(values: F64, before: NDArray[np.int64], t: F64, length: F64) -> F64:
    """Cubic spline values; each keyframe has in-tangent, value, out-tangent, with tangents per second."""
    leave, arrive = values[2::3][before] * length, values[0::3][before + 1] * length
    return animated.hermite(values[1::3][before], leave, arrive, values[1::3][before + 1], t)


def read(path: Path, content: object = None) -> CameraFile:
    """Read the cameras of a model, see `animated.camera_file`.

    Raises SceneError if it is damaged, or has no usable camera.
    """
    file = GltfFile(path, _Model, "camera file")
    nodes = list(file.placed_nodes())
    cameras = [some for some in nodes if some.node.camera is not None]
    scenes = [some for some in nodes if some.is_scene][:1]
    channels = read_channels(file, {index for some in cameras + scenes for index in some.chain})
    scene = None
    for some in scenes:
        scene = animated.FoundScene(_times(_above(some, channels)), partial(_matrices, file, some, channels))
    found = [(some, *_lens(file, some)) for some in cameras]
    left_out = [name for _, name, lens in found if lens is None]
    kept = [_camera(file, some, name, lens, channels) for some, name, lens in found if lens is not None]
    return animated.camera_file(path, kept, scene, None, left_out)


def _times(channels: list[Channel]) -> animated.Times | None:
    """First and last keyframe time of the moving channels; None if there are none."""
    ends = [(float(one.times[0]), float(one.times[-1])) for one in channels if one.is_moving]
    return (min(first for first, _ in ends), max(last for _, last in ends)) if ends else None


def _above(some: PlacedNode, channels: Channels) -> list[Channel]:
    """The channels of a node and of the nodes above it."""
    return [channel for index in some.chain for channel in channels.get(("node", index), {}).values()]


def _lens(file: _File, some: PlacedNode) -> tuple[str, _Perspective | None]:
    """The name of a camera in words, and its lens, or None if it is no perspective camera."""
    index = some.node.camera
    camera = file.item(file.top.cameras, index, "a node refers to cameras")
    own_name = camera.name if some.node.name is None else some.node.name
    name = f"camera {own_name[:60]!r}" if isinstance(own_name, str) else f"camera {index}"
    return name, camera.perspective if camera.type == "perspective" else None


def _camera(file: _File, some: PlacedNode, name: str, lens: _Perspective, channels: Channels) -> FoundCamera:
    opening = channels.get(("camera", some.node.camera or 0), {}).get("yfov")

    def at(moments: F64) -> tuple[F64, LensTrack]:
        count = len(moments)
        angles = np.full(count, lens.yfov) if opening is None else opening.at(file, moments)[:, 0]
        if not ((angles > _MIN_ANGLE) & (angles < np.pi)).all():
            rule = f"must be above 0 and below half a turn, got {angles.min():g} to {angles.max():g}"
            raise SceneError(file.path, f"yfov of {name} {rule}; {CURE}")
        near, aspect = np.full(count, lens.znear), lens.aspect_ratio or animated.DEFAULT_ASPECT
        track = LensTrack(0.5 / np.tan(angles / 2), np.zeros((count, 2)), near, aspect)
        return _matrices(file, some, channels, moments), track

    movers = _above(some, channels) + ([] if opening is None else [opening])
    return FoundCamera(name, _times(movers), at)


def _matrices(file: _File, some: PlacedNode, channels: Channels, moments: F64) -> F64:
    """[T, 4, 4] world from node, at times [T] in seconds."""
    matrices = np.tile(np.eye(4), (len(moments), 1, 1))
    with np.errstate(over="ignore", invalid="ignore"):
        for index in some.chain:
            parts = channels.get(("node", index), {})
            moved = {name: channel.at(file, moments) for name, channel in parts.items()}
            matrices = matrices @ file.local_matrices(index, moved)
    if not np.isfinite(matrices).all():
        raise SceneError(file.path, f"its nodes scale beyond all numbers; {CURE}")
    return matrices
