"""Read the camera of a LichtFeld Studio timeline, JSON of version 4 and earlier.

Keyframes have a time in seconds, a position, a rotation w, x, y, z (world from camera; x right, y up, z
backward), a focal length in mm for a film 24 mm high, and an easing until the next keyframe. The world of its
viewer has y up and z backward; scenes and the returned cameras keep the axes of training, y down and z
forward. Positions are interpolated by a uniform Catmull-Rom spline, rotations along the shorter arc, focal
lengths linearly, all at the eased share of the time between two keyframes.
Source: LichtFeld Studio (github.com/MrNeRF/LichtFeld-Studio), src/sequencer/timeline.cpp, interpolation.cpp
and keyframe.hpp; src/rendering/include/rendering/coordinate_conventions.hpp and render_constants.hpp.
"""

from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import numpy as np
from msgspec import Meta, Struct

from brushgs.errors import SceneError
from brushgs.formats.cameras import animated
from brushgs.formats.cameras.animated import FoundCamera, LensTrack
from brushgs.formats.cameras.read import CameraFile
from brushgs.formats.schema import decode, refused
from brushgs.values.arrays import F64
from brushgs.values.quats import normalized, rotation_matrices

_CURE = "save the timeline again"
_FILM_HEIGHT = 24.0  # mm
_SCENE_FROM_WORLD = np.diag([1.0, -1.0, -1.0])
_LINEAR, _IN, _OUT, _IN_OUT = range(4)


class _Key(Struct):
    """A keyframe; `easing` applies until the next one."""

    time: float
    position: animated.Point
    rotation: animated.Quat
    focal_length_mm: Annotated[float, Meta(gt=0)]
    easing: Literal[0, 1, 2, 3] = 0


class _Timeline(Struct):
    keyframes: list[_Key]
    version: Annotated[int, Meta(ge=1, le=4)] = 4


def read(path: Path, content: bytes) -> CameraFile:
    """Read an object with the field "keyframes".

    Raises SceneError if a field is wrong, there are no keyframes, or a view cannot be drawn.
    """
    found = decode(path, content, _Timeline, _CURE).keyframes
    if not found:
        raise SceneError(path, f"has no keyframes; add some to the timeline, and {_CURE}")
    for index, key in enumerate(found):
        if not any(key.rotation):
            raise refused(path, f"keyframes[{index}].rotation", "a rotation", list(key.rotation), _CURE)
    keys = _Keys.of(sorted(found, key=lambda key: key.time))
    span = (float(keys.times[0]), float(keys.times[-1])) if len(found) > 1 else None
    camera = FoundCamera("the camera of the timeline", span, keys.at)
    return animated.camera_file(path, [camera], None, None, ())


class _Keys(NamedTuple):
    """K keyframes: times [K], positions [K, 3], quaternions [K, 4], focal lengths [K] in mm, easings [K]."""

    times: F64
    places: F64
    quats: F64
    focal: F64
    easing: F64

    @classmethod
    def of(cls, keys: list[_Key]) -> "_Keys":
        columns = (
            [getattr(key, name) for key in keys]
            for name in ("time", "position", "rotation", "focal_length_mm", "easing")
        )
        times, places, quats, focal, easing = (np.array(column, np.float64) for column in columns)
        return cls(times, places, normalized(quats), focal, easing)

    def at(self, moments: F64) -> tuple[F64, LensTrack]:
        """World from camera [T, 4, 4] in the axes of the scene, and the lens; see `FoundCamera`."""
        last = len(self.times) - 1
        # The time of a keyframe belongs to the segment that ends there.
        start = np.clip(np.searchsorted(self.times, moments) - 1, 0, max(last - 1, 0))
        end = np.minimum(start + 1, last)
        length = self.times[end] - self.times[start]
        share = np.clip((moments - self.times[start]) / np.where(length > 0, length, 1), 0, 1)
        share = eased(share, self.easing[start])[:, None]
        before, after = np.maximum(start - 1, 0), np.minimum(end + 1, last)
        leave = 0.5 * (self.places[end] - self.places[before])
        arrive = 0.5 * (self.places[after] - self.places[start])
        places = animated.hermite(self.places[start], leave, arrive, self.places[end], share)
        turns = rotation_matrices(animated.slerp(self.quats[start], self.quats[end], share))
        focal = self.focal[start] + share[:, 0] * (self.focal[end] - self.focal[start])
        return animated.steered(turns, places, focal / _FILM_HEIGHT, _SCENE_FROM_WORLD)


def eased(share: F64, easing: F64) -> F64:
    """Apply cubic easings [T] (0 linear, 1 in, 2 out, 3 in and out) to shares of a duration [T], 0 to 1."""
    rest = 1 - share
    both = np.where(share < 0.5, 4 * share**3, 1 - 4 * rest**3)
    curves = [share**3, 1 - rest**3, both]
    return np.select([easing == kind for kind in (_IN, _OUT, _IN_OUT)], curves, share)
