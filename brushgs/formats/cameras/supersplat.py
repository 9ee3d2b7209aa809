"""Read the camera animation of a SuperSplat project: an archive with `document.json`, or that file itself.

Poses have a frame, a position, a target and a field of view in degrees along the longer side of the picture.
The camera does not roll: y is up in the world of the editor. The editor rotates a loaded scene by half a turn
about z and rotates it back on export; cameras are returned in scene coordinates. If the scene was moved in
the editor, these are the coordinates of the exported scene, not of the loaded file.
Positions, targets and fields of view are interpolated over frames by a cubic Hermite spline, which closes at
the end of the timeline; the velocity at a pose is that between its two neighbors, times the smoothness.
Source: SuperSplat (github.com/playcanvas/supersplat), src/camera-poses.ts, timeline.ts, camera.ts,
anim/spline.ts and doc.ts.
"""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
from msgspec import Meta, Struct, field

from brushgs.errors import SceneError
from brushgs.formats.cameras import animated
from brushgs.formats.cameras.animated import FoundCamera, LensTrack
from brushgs.formats.cameras.read import CameraFile
from brushgs.formats.schema import MAX_BYTES, decode, refused
from brushgs.formats.zip_file import open_zip, read_member
from brushgs.values.arrays import F64

_DOCUMENT = "document.json"
_CURE = "save the project again"
_SCENE_FROM_WORLD = np.diag([-1.0, -1.0, 1.0])

Angle = Annotated[float, Meta(gt=0, lt=180)]


class _Pose(Struct):
    position: animated.Point
    target: animated.Point
    frame: Annotated[float, Meta(ge=0)] | None = None
    fov: Angle | None = None


class _PoseSet(Struct):
    poses: list[_Pose] = field(default_factory=list)


class _Timeline(Struct, rename="camel"):
    frames: Annotated[float, Meta(ge=1)] = 180.0
    frame_rate: Annotated[float, Meta(gt=0)] = 30.0
    smoothness: Annotated[float, Meta(ge=0, le=1)] = 1.0


class _View(Struct):
    fov: Angle = 60.0


class _Document(Struct, rename={"pose_sets": "poseSets"}):
    pose_sets: list[_PoseSet]
    timeline: _Timeline = field(default_factory=_Timeline)
    camera: _View = field(default_factory=_View)


def read(path: Path, content: bytes | None) -> CameraFile:
    """Read the first set of poses, as the editor does; poses beyond the timeline are left out.

    `content` is the document, or None for an archive. Raises SceneError if it is damaged, has no poses, or a
    view cannot be drawn.
    """
    document = decode(path, _unpacked(path) if content is None else content, _Document, _CURE)
    timeline, keys = document.timeline, _Keys.of(path, document)
    span = (0.0, timeline.frames / timeline.frame_rate) if len(keys.frames) > 1 else None
    found = FoundCamera("the camera of the poses", span, keys.at)
    file = animated.camera_file(path, [found], None, timeline.frame_rate, ())
    return replace(file, is_loop=span is not None)


def _unpacked(path: Path) -> bytes:
    """Read the document of a project archive, at most `MAX_BYTES`."""
    lacks = f"is no SuperSplat project, it has no {_DOCUMENT}; {_CURE}"
    with open_zip(path) as archive:
        return read_member(path, archive, _DOCUMENT, MAX_BYTES, lacks=lacks, cure=_CURE)


class _Keys(NamedTuple):
    """K poses; if there are several, padded with two of the previous and two of the next loop."""

    path: Path  # the file, for messages
    fps: float  # frames a second
    frames: F64  # [K] ascending
    values: F64  # [K, 7] position, target, field of view in degrees
    speeds: F64  # [K, 7] change per frame

    @classmethod
    def of(cls, path: Path, document: _Document) -> "_Keys":
        """The poses of a document. Raises SceneError if there are none, or two at the same frame."""
        timeline, poses = document.timeline, document.pose_sets[0].poses if document.pose_sets else []
        frames = [i * timeline.frame_rate if one.frame is None else one.frame for i, one in enumerate(poses)]
        kept = sorted((frame, i) for i, frame in enumerate(frames) if frame < timeline.frames)
        if not kept:
            fact = f"has no camera poses before frame {timeline.frames:g}"
            raise SceneError(path, f"{fact}; add some to the timeline of SuperSplat, and {_CURE}")
        for _, i in kept:
            if poses[i].position == poses[i].target:
                rule = "another point than the position"
                raise refused(path, f"poseSets[0].poses[{i}].target", rule, list(poses[i].target), _CURE)
        times = np.array([frame for frame, _ in kept])
        if (np.diff(times) <= 0).any():
            frame = times[np.flatnonzero(np.diff(times) <= 0)[0]]
            raise SceneError(path, f"poseSets[0] has two poses at frame {frame:g}; remove one, and {_CURE}")
        found = [(poses[i], poses[i].fov or document.camera.fov) for _, i in kept]
        values = np.array([[*pose.position, *pose.target, fov] for pose, fov in found])
        speeds = np.zeros_like(values)
        if len(kept) > 1:
            length = timeline.frames
            times = np.concatenate([times[-2:] - length, times, times[:2] + length])
            values = np.concatenate([values[-2:], values, values[:2]])
            slopes = timeline.smoothness * (values[2:] - values[:-2]) / (times[2:] - times[:-2])[:, None]
            speeds = np.pad(slopes, ((1, 1), (0, 0)))
        return cls(path, timeline.frame_rate, times, values, speeds)

    def at(self, moments: F64) -> tuple[F64, LensTrack]:
        """World from camera [T, 4, 4] in scene coordinates, and the lens; see `FoundCamera`."""
        values = np.repeat(self.values[:1], len(moments), axis=0)
        if len(self.frames) > 1:
            frames = moments * self.fps
            start = np.clip(np.searchsorted(self.frames, frames, side="right") - 1, 1, len(self.frames) - 3)
            length = np.diff(self.frames)[start][:, None]
            share = (frames - self.frames[start])[:, None] / length
            leave, arrive = self.speeds[start] * length, self.speeds[start + 1] * length
            values = animated.hermite(self.values[start], leave, arrive, self.values[start + 1], share)
        turns = self._turns(values[:, 3:6] - values[:, :3])
        focal = max(animated.DEFAULT_ASPECT, 1.0) / 2 / np.tan(np.radians(values[:, 6]) / 2)
        return animated.steered(turns, values[:, :3], focal, _SCENE_FROM_WORLD)

    def _turns(self, ahead: F64) -> F64:
        """[T, 3, 3] world from camera, for cameras without roll that look along `ahead` [T, 3]."""
        with np.errstate(all="ignore"):
            back = -ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
        if not np.isfinite(back).all():
            fact = "between two poses the camera meets its target"
            raise SceneError(self.path, f"{fact}; move a pose, and {_CURE}")
        azimuth = np.arctan2(back[:, 0], back[:, 2])
        right = np.stack([np.cos(azimuth), np.zeros(len(back)), -np.sin(azimuth)], axis=1)
        return np.stack([right, np.cross(back, right), back], axis=2)
