"""Read cameras and splats of an untrusted USD stage as arrays; runs in the child process of the package.

Layers that the file names must lie in its folder. The T sample times are equally spaced; T is 1 for still
prims.

The header of cameras has "seconds" (0 if nothing moves), "fps", "left_out" (names of cameras without
perspective), and "cameras", a list of {"name"}. Camera i has the arrays matrices_i [T, 4, 4], world from
camera, and lens_i [T, 7], see `LENS`. "scene" tells whether there is a painted scene; its matrices are in
scene.npy.

The header of splats has "up" ("Y", "Z", or null if the stage does not state it) and "parts", a list of
{"notes"}, the text of our notes or null. Part i has the arrays means_i [N, 3], quats_i [N, 4] (x, y, z, w),
scales_i [N, 3], opacities_i [N], sh_i [N, k, 3] and matrix_i [4, 4], world from splats; all but the last as
stored, float32 or float16. Source: OpenUSD, UsdVolParticleField3DGaussianSplat.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Ar, Sdf, Usd, UsdGeom

from brushgs.formats.gltf_file import is_scene_name
from brushgs.formats.usd import TYPE, RefusedError
from brushgs.values.arrays import F64

_MAX_LAYERS = 1000
_MAX_PRIMS = 1_000_000


def open_stage(path: Path) -> Any:
    """Open the stage of a file.

    Raises RefusedError if it names files outside its folder, or too many; Tf.ErrorException if damaged.
    """
    layer = Sdf.Layer.FindOrOpen(str(path.resolve()))
    if layer is None:
        raise RefusedError("is damaged, or no USD file; export it again")
    folder = path.resolve().parent
    pending, seen = [layer], {layer.identifier}
    while pending:
        layer = pending.pop()
        for name in layer.GetCompositionAssetDependencies():
            full = Sdf.ComputeAssetPathRelativeToLayer(layer, name)
            outer = Ar.SplitPackageRelativePathOuter(full)[0]
            if not Path(outer).resolve().is_relative_to(folder):
                fact = f"names the file {name[:100]!r}, which lies outside its folder"
                raise RefusedError(f"{fact}; put it beside this file, or export all in one file")
            found = Sdf.Layer.FindOrOpen(full) if full not in seen else None
            seen.add(full)
            if len(seen) > _MAX_LAYERS:
                raise RefusedError(f"must name at most {_MAX_LAYERS} files; export all in one file")
            if found is not None:
                pending.append(found)
    return Usd.Stage.Open(str(path.resolve()))


def prims(stage: Any) -> Iterator[Any]:
    """Yield the prims of a stage, parents first. Raises RefusedError if there are too many."""
    for number, prim in enumerate(stage.Traverse()):
        if number == _MAX_PRIMS:
            raise RefusedError(f"must hold at most {_MAX_PRIMS:,} prims; export only what is needed of it")
        yield prim


_APERTURE = "horizontalAperture", "verticalAperture", "horizontalApertureOffset", "verticalApertureOffset"
LENS = ("focalLength", *_APERTURE)  # columns of a lens, followed by both ends of clippingRange
# Blender imports scenes as glTF only, and rotates the axes within each object from +y up to +z up. Its glTF
# export rotates them back, its USD export does not.
_BLENDER_FROM_GLTF = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], np.float64)
_MAX_CAMERAS = 10_000
_MAX_SAMPLES = 200_000  # samples of all moving cameras


def read_cameras(path: Path, folder: Path) -> dict[str, Any]:
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
        raise RefusedError(f"its cameras move for {seconds:,.0f} s, too many frames; export a part of it")
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
    """The perspective cameras of a stage, its other cameras, and the painted scene (at most one)."""
    found, left_out, scenes = list[Any](), list[Any](), list[Any]()
    for prim in prims(stage):
        if prim.IsA(UsdGeom.Camera):
            is_perspective = prim.GetAttribute("projection").Get() == "perspective"
            (found if is_perspective else left_out).append(prim)
        if not scenes and is_scene_name(prim.GetName()) and prim.IsA(UsdGeom.Xformable):
            scenes.append(prim)
    return found, left_out, scenes


def _chain(prim: Any) -> list[Any]:
    """The transformable prims from a prim up to the root."""
    chain = []
    while prim and not prim.IsPseudoRoot():
        if prim.IsA(UsdGeom.Xformable):
            chain.append(UsdGeom.Xformable(prim))
        prim = prim.GetParent()
    return chain


def _lens_attributes(prim: Any) -> list[Any]:
    return [prim.GetAttribute(name) for name in (*LENS, "clippingRange")] if prim.IsA(UsdGeom.Camera) else []


def _may_move(prim: Any) -> bool:
    """Whether a prim, one above it, or its lens may have more than one time sample."""
    moves = any(some.TransformMightBeTimeVarying() for some in _chain(prim))
    return moves or any(some.ValueMightBeTimeVarying() for some in _lens_attributes(prim))


def _span(stage: Any, found: list[Any]) -> tuple[float, float]:
    """Start and end in time codes: those of the stage, else the first and the last sample."""
    if stage.HasAuthoredTimeCodeRange() and stage.GetEndTimeCode() > stage.GetStartTimeCode():
        span = stage.GetStartTimeCode(), stage.GetEndTimeCode()
    else:
        animated = (some for prim in found for some in (*_chain(prim), *_lens_attributes(prim)))
        samples = [times for some in animated if (times := some.GetTimeSamples())]  # each ascending
        firsts, lasts = (times[0] for times in samples), (times[-1] for times in samples)
        span = min(firsts, default=0.0), max(lasts, default=0.0)
    if not np.isfinite(span).all():
        raise RefusedError("must have finite times; export it again")
    return span


def _matrices(prim: Any, times: F64) -> F64:
    """[T, 4, 4] world from prim, for column vectors; USD uses row vectors."""
    xform = UsdGeom.Xformable(prim)
    found = [np.array(xform.ComputeLocalToWorldTransform(Usd.TimeCode(float(time)))) for time in times]
    return np.array(found, np.float64).transpose(0, 2, 1)


def _lens(prim: Any, times: F64) -> F64:
    """[T, 7] lens of a camera, see `LENS`."""
    rows = []
    for time in times:
        *lens, clip = (some.Get(Usd.TimeCode(float(time))) for some in _lens_attributes(prim))
        rows.append([*lens, *clip])
    return np.array(rows, np.float64)


NOTES = "brushgs"
_MAX_PARTS = 1000
_MAX_DEGREE, _USED_DEGREE = 10, 3
_FIRST = Usd.TimeCode.EarliestTime()  # time at which animated values are read


def read_splats(path: Path, folder: Path) -> dict[str, Any]:
    """Write the arrays, and return the header."""
    stage = open_stage(path)
    found = [prim for prim in prims(stage) if prim.GetTypeName() == TYPE]
    if len(found) > _MAX_PARTS:
        raise RefusedError(f"must hold at most {_MAX_PARTS:,} prims of splats; export only what is needed")
    parts: list[dict[str, Any]] = []
    for prim in found:
        is_seen = UsdGeom.Imageable(prim).ComputeVisibility() != UsdGeom.Tokens.invisible
        if not is_seen or (arrays := _arrays(prim)) is None:
            continue
        for name, array in arrays.items():
            np.save(folder / f"{name}_{len(parts)}.npy", array)
        notes = prim.GetCustomDataByKey(NOTES)
        parts.append({"notes": notes if isinstance(notes, str) else None})
    has_up = stage.HasAuthoredMetadata("upAxis")
    return {"up": str(UsdGeom.GetStageUpAxis(stage)) if has_up else None, "parts": parts}


def _arrays(prim: Any) -> dict[str, NDArray[Any]] | None:
    """The columns of one prim; None if it has no particles."""
    means = _column(prim, "positions", (3,), None)
    if means is None or not len(means):
        return None
    count = len(means)
    degree = prim.GetAttribute("radiance:sphericalHarmonicsDegree").Get(_FIRST)
    degree = 3 if degree is None else degree  # the default of the schema
    if not isinstance(degree, int) or not 0 <= degree <= _MAX_DEGREE:
        raise RefusedError(f"must have a sphericalHarmonicsDegree of 0 to {_MAX_DEGREE}, got {degree!r}")
    terms = (degree + 1) ** 2
    sh = _column(prim, "radiance:sphericalHarmonicsCoefficients", (3,), None)
    if sh is None or len(sh) < count * terms:  # the schema defines grey in this case
        sh = np.zeros((count, 1, 3), np.float32)
    else:
        sh = sh[: count * terms].reshape(count, terms, 3)[:, : (_USED_DEGREE + 1) ** 2]
    xform = UsdGeom.Xformable(prim)
    return {
        "means": means,
        "quats": _full(prim, "orientations", count, (0, 0, 0, 1)),
        "scales": _full(prim, "scales", count, (1, 1, 1)),
        "opacities": _full(prim, "opacities", count, ()),
        "sh": sh,
        "matrix": np.array(xform.ComputeLocalToWorldTransform(_FIRST), np.float64).T,
    }


def _full(prim: Any, name: str, count: int, default: tuple[float, ...]) -> NDArray[Any]:
    """A column of `count` rows; the default of the schema if the attribute is missing."""
    shape = (len(default),) if default else ()
    found = _column(prim, name, shape, count)
    return np.full((count, *shape), default or 1, np.float32) if found is None else found


def _column(prim: Any, name: str, shape: tuple[int, ...], count: int | None) -> NDArray[Any] | None:
    """An attribute, or its half-float variant if it has no value; None if neither has one.

    Rows beyond `count` are dropped. Raises RefusedError if there are fewer, or the shape or type is wrong.
    """
    for full_name in (name, f"{name}h"):
        attribute = prim.GetAttribute(full_name)
        value = attribute.Get(_FIRST) if attribute else None
        if value is None or not len(value):
            continue
        array = np.array(value)
        if array.shape[1:] != shape or array.dtype.kind != "f":
            raise RefusedError(f"attribute {full_name} has values of another kind; export it again")
        if count is not None and len(array) < count:
            rule = f"attribute {full_name} must have {count:,} rows, like positions"
            raise RefusedError(f"{rule}, got {len(array):,}; export it again")
        return array[:count]
    return None
