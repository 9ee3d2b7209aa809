"""The cameras of USD stages: views, or the frames of an animated camera at the rate of the stage.

Cameras look along -z with y up. Focal length and apertures have the same unit, so only their ratios matter.
The unit of length and the up axis of the stage are ignored: the stage is in scene coordinates, unless a prim
'brushgs_scene' gives the transform of the scene. Source: OpenUSD, UsdGeomCamera.
"""

from functools import partial
from pathlib import Path

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.cameras.animated import FoundCamera, FoundScene, LensTrack, Times, camera_file
from brushgs.formats.cameras.read import CameraFile
from brushgs.formats.usd import reading
from brushgs.values.arrays import F64


def read(path: Path, content: object = None) -> CameraFile:
    """Read the cameras of a stage, see `animated.camera_file`.

    Raises SceneError if the package usd-core is missing, the file is damaged, or it has no usable camera.
    """
    with reading(path, "cameras") as answer:
        seconds, fps = answer.header["seconds"], answer.header["fps"]
        cameras = []
        for index, camera in enumerate(answer.header["cameras"]):
            name = f"camera {camera['name']!r}"
            matrices, lens = answer.array(f"matrices_{index}"), answer.array(f"lens_{index}")
            if not (np.isfinite(lens).all() and (lens[:, [0, 1, 2, 5]] > 0).all()):
                rule = "must have a focal length, apertures and a near clipping plane above 0"
                raise SceneError(path, f"{name} {rule}; export it again")
            times = _times(seconds, matrices, lens)
            cameras.append(FoundCamera(name, times, partial(_camera_at, seconds, matrices, lens)))
        scene = None
        if answer.header["scene"]:
            matrices = answer.array("scene")
            scene = FoundScene(_times(seconds, matrices), partial(_between, seconds, matrices))
        left_out = [f"camera {name!r}" for name in answer.header["left_out"]]
    return camera_file(path, cameras, scene, fps, left_out)


def _times(seconds: float, *tracks: F64) -> Times | None:
    """Start and end of the animation, or None if no track changes."""
    return (0.0, seconds) if any((track != track[0]).any() for track in tracks) else None


def _between(seconds: float, track: F64, moments: F64) -> F64:
    """Values [T, ...] at times [T], by linear interpolation between the samples of a track."""
    if len(track) == 1:
        return np.repeat(track, len(moments), axis=0)
    place = np.clip(moments / seconds, 0, 1) * (len(track) - 1)
    before = np.minimum(place.astype(np.int64), len(track) - 2)
    # A time that equals a sample time up to rounding gets exactly the value of the sample.
    share = (np.round(place, 9) - before).reshape(-1, *[1] * (track.ndim - 1))
    with np.errstate(all="ignore"):
        return np.asarray((1 - share) * track[before] + share * track[before + 1])


def _camera_at(seconds: float, matrices: F64, lens: F64, moments: F64) -> tuple[F64, LensTrack]:
    focal, _, high, right, up, near, _ = _between(seconds, lens, moments).T
    center = np.stack([-right / high, up / high], axis=1)
    aspect = float(lens[0, 1] / lens[0, 2])
    return _between(seconds, matrices, moments), LensTrack(focal / high, center, near, aspect)
