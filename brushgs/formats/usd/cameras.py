"""The cameras of a USD stage become arrays; runs in the process that `process` starts.

The header has "seconds" (0 where nothing moves), "fps", "left_out", the names of cameras that are no
perspective ones, and "cameras", a list of {"name"}. Camera i has the arrays matrices_i [T, 4, 4], world from
camera, and lens_i [T, 7], see `LENS`. "scene" says whether there is a painted scene, with its matrices in
scene.npy. T moments are equally far apart in time; T is 1 where a thing stands still.
"""

from pathlib import Path
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from brushgs.formats.scene_node import is_scene_name
from brushgs.formats.usd.refused import RefusedError
from brushgs.formats.usd.stage import open_stage, prims
from brushgs.values.arrays import F64

LENS = (
    "focalLength",
    "horizontalAperture",
    "verticalAperture",
    "horizontalApertureOffset",
    "verticalApertureOffset",
)  # and both ends of clippingRange
# Blender takes scenes in as glTF only, and turns the axes within each object: +y up becomes +z up. What it
# exports as glTF is turned back, what it exports as USD is not.
_BLENDER_FROM_GLTF = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], np.float64)
_MAX_CAMERAS = 10_000
_MAX_SAMPLES = 200_000  # of all cameras that move


def read(path: Path, folder: Path) -> dict[str, Any]:
    """Write the arrays, and return the header."""
    stage = open_stage(path)
    found, left_out, scenes = _find(stage)
    if len(found) > _MAX_CAMERAS:
        raise RefusedError(f"must hold at most {_MAX_CAMERAS:,} cameras; export only what is needed of it")
    rate = stage.GetTimeCodesPerSecond()
    fps = stage.GetFramesPerSecond() if stage.HasAuthoredMetadata("framesPerSecond") else rate
    if not (0 < rate < 1e6 and 0 < fps < 1e6):
        raise RefusedError(f"must have timeCodesPerSecond and framesPerSecond above 0, got {rate:g}, {fps:g}")
    start, end = _span(stage, found + scenes)
    seconds = max((end - start) / rate, 0.0)
    num_moving = sum(_may_move(prim) for prim in found + scenes)
    if seconds * fps * num_moving >= _MAX_SAMPLES:
        fact = f"its cameras move for {seconds:,.0f} s, which is too many frames"
        raise RefusedError(f"{fact}; export a part of it, or fewer cameras")
    times = np.linspace(start, end, max(round(seconds * fps), 1) + 1) if seconds > 0 else np.array([start])
    for index, prim in enumerate(found):
        moments = times if _may_move(prim) else times[:1]
        np.save(folder / f"matrices_{index}.npy", _matrices(prim, moments))
        np.save(folder / f"lens_{index}.npy", _lens(prim, moments))
    for prim in scenes:
        matrices = _matrices(prim, times if _may_move(prim) else times[:1])
        if stage.GetRootLayer().documentation.startswith("Blender"):
            matrices = matrices @ _BLENDER_FROM_GLTF
        np.save(folder / "scene.npy", matrices)
    return {
        "seconds": seconds,
        "fps": fps,
        "cameras": [{"name": prim.GetName()[:60]} for prim in found],
        "left_out": [prim.GetName()[:60] for prim in left_out[:_MAX_CAMERAS]],
        "scene": bool(scenes),
    }


def _find(stage: Any) -> tuple[list[Any], list[Any], list[Any]]:
    """Perspective cameras of a stage, its other cameras, and the painted scene, at most one."""
    found: list[Any] = []
    left_out: list[Any] = []
    scenes: list[Any] = []
    for prim in prims(stage):
        if prim.IsA(UsdGeom.Camera):
            is_perspective = prim.GetAttribute("projection").Get() == "perspective"
            (found if is_perspective else left_out).append(prim)
        if not scenes and is_scene_name(prim.GetName()) and prim.IsA(UsdGeom.Xformable):
            scenes.append(prim)
    return found, left_out, scenes


def _chain(prim: Any) -> list[Any]:
    """A prim and those above it that place it."""
    chain = []
    while prim and not prim.IsPseudoRoot():
        if prim.IsA(UsdGeom.Xformable):
            chain.append(UsdGeom.Xformable(prim))
        prim = prim.GetParent()
    return chain


def _lens_attributes(prim: Any) -> list[Any]:
    return [prim.GetAttribute(name) for name in (*LENS, "clippingRange")] if prim.IsA(UsdGeom.Camera) else []


def _may_move(prim: Any) -> bool:
    """Whether a prim or its lens has more than one sample in time."""
    moves = any(some.TransformMightBeTimeVarying() for some in _chain(prim))
    return moves or any(some.ValueMightBeTimeVarying() for some in _lens_attributes(prim))


def _span(stage: Any, found: list[Any]) -> tuple[float, float]:
    """Start and end in time codes: those of the stage, else from the first sample to the last."""
    if stage.HasAuthoredTimeCodeRange() and stage.GetEndTimeCode() > stage.GetStartTimeCode():
        span = stage.GetStartTimeCode(), stage.GetEndTimeCode()
    else:
        samples = [
            time
            for prim in found
            for some in (*_chain(prim), *_lens_attributes(prim))
            for time in (lambda all_of: (all_of[0], all_of[-1]) if all_of else ())(some.GetTimeSamples())
        ]
        span = min(samples, default=0.0), max(samples, default=0.0)
    if not np.isfinite(span).all():
        raise RefusedError("must have finite times; export it again")
    return span


def _matrices(prim: Any, times: F64) -> F64:
    """[T, 4, 4] world from prim, on column vectors; USD has rows."""
    xform = UsdGeom.Xformable(prim)
    found = [np.array(xform.ComputeLocalToWorldTransform(Usd.TimeCode(float(time)))) for time in times]
    return np.array(found, np.float64).transpose(0, 2, 1)


def _lens(prim: Any, times: F64) -> F64:
    """[T, 7]."""
    rows = []
    for time in times:
        *lens, clip = (some.Get(Usd.TimeCode(float(time))) for some in _lens_attributes(prim))
        rows.append([*lens, *clip])
    return np.array(rows, np.float64)
