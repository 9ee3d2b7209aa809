"""The Gaussian splats of a USD stage become arrays; runs in the process that `process` starts.

The header has "up" ("Y", "Z", or null where the stage does not say) and "parts", a list of {"notes"}, the
text of what we recorded or null. Part i has the arrays means_i [N, 3], quats_i [N, 4] (x, y, z, w), scales_i
[N, 3], opacities_i [N], sh_i [N, k, 3] and matrix_i [4, 4], world from splats; all but the last as stored, of
float32 or float16.
Source: OpenUSD, UsdVolParticleField3DGaussianSplat.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from brushgs.formats.usd.refused import RefusedError
from brushgs.formats.usd.stage import open_stage, prims

TYPE = "ParticleField3DGaussianSplat"
NOTES = "brushgs"
_MAX_PARTS = 1000
_MAX_DEGREE, _USED_DEGREE = 10, 3
_FIRST = Usd.TimeCode.EarliestTime()  # of what changes in time


def read(path: Path, folder: Path) -> dict[str, Any]:
    """Write the arrays, and return the header."""
    stage = open_stage(path)
    found = [prim for prim in prims(stage) if prim.GetTypeName() == TYPE and _is_visible(prim)]
    if len(found) > _MAX_PARTS:
        raise RefusedError(f"must hold at most {_MAX_PARTS:,} prims of splats; export only what is needed")
    parts: list[dict[str, Any]] = []
    for prim in found:
        if (arrays := _arrays(prim)) is None:
            continue
        for name, array in arrays.items():
            np.save(folder / f"{name}_{len(parts)}.npy", array)
        notes = prim.GetCustomDataByKey(NOTES)
        parts.append({"notes": notes if isinstance(notes, str) else None})
    has_up = stage.HasAuthoredMetadata("upAxis")
    return {"up": str(UsdGeom.GetStageUpAxis(stage)) if has_up else None, "parts": parts}


def _is_visible(prim: Any) -> bool:
    return bool(UsdGeom.Imageable(prim).ComputeVisibility() != UsdGeom.Tokens.invisible)


def _arrays(prim: Any) -> dict[str, NDArray[Any]] | None:
    """The columns of one prim; None where it has no particles."""
    means = _column(prim, "positions", (3,), None)
    if means is None or not len(means):
        return None
    count = len(means)
    degree = prim.GetAttribute("radiance:sphericalHarmonicsDegree").Get(_FIRST)
    degree = 3 if degree is None else degree  # of the schema
    if not isinstance(degree, int) or not 0 <= degree <= _MAX_DEGREE:
        raise RefusedError(f"must have a sphericalHarmonicsDegree of 0 to {_MAX_DEGREE}, got {degree!r}")
    terms = (degree + 1) ** 2
    sh = _column(prim, "radiance:sphericalHarmonicsCoefficients", (3,), None)
    if sh is None or len(sh) < count * terms:  # then it is grey, by the schema
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
    """A column of as many rows as there are particles; the default of the schema where there is none."""
    shape = (len(default),) if default else ()
    found = _column(prim, name, shape, count)
    return np.full((count, *shape), default or 1, np.float32) if found is None else found


def _column(prim: Any, name: str, shape: tuple[int, ...], count: int | None) -> NDArray[Any] | None:
    """An attribute, or its half-float twin where it has no value; None where neither has one.

    Rows beyond `count` are left out. Raises RefusedError where there are fewer, or they are of another shape.
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
