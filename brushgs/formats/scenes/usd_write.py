"""Gaussians become a USD stage with one prim of ParticleField3DGaussianSplat, all numbers as float32.

The stage has +y up, and scenes do not: where the first view of a scene is known, the prim turns it upright,
as the node of a .glb does. Rows keep their order, but for strokes with brushes, which are sorted by these.
Source: OpenUSD, UsdVol, 26.03.
"""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError
from brushgs.formats.files import replacing
from brushgs.formats.scene_node import SCENE_NODE
from brushgs.formats.scenes.finite_logs import finite_scales, unit_quats
from brushgs.formats.scenes.order import brush_order
from brushgs.formats.scenes.stored import NOTHING, Stored, text_of
from brushgs.formats.scenes.upright_notes import NOTES, notes_of
from brushgs.formats.usd.process import INSTALL, is_usd_here
from brushgs.values.gaussians import Gaussians

# Bytes that a number takes at most, where not four: text, and an archive with its member. OpenUSD raises an
# error of its own where the disk is full.
_BYTES = {".usda": 16, ".usdz": 8}
_ROOM = 1 << 16  # of notes and the rest
_REACH = 3  # standard deviations that the extent of the prim includes


def write_scene(
    gaussians: Gaussians,
    path: str | Path,
    known: Stored = NOTHING,
) -> NDArray[np.int64] | None:
    """Write one prim of splats, and what is recorded as its `customData`.

    `known` is what is recorded; the suffix decides between text (.usda), binary and
    an archive (.usdz). Rotations are written with length 1.

    Returns:
        The rows in the order of the file; None if it is theirs, or recorded.

    Raises:
        ValueError: if the names of brushes are too long.
        SceneError: if the package usd-core is missing, or the file cannot be written.
    """
    if not is_usd_here():
        raise SceneError(path, f"is a USD file, which the package usd-core writes; install it with {INSTALL}")
    order = brush_order(gaussians)
    rows = gaussians if order is None else gaussians.take(order)
    stored = known.sorted_by(rows, order)
    stage = _stage(rows, stored)
    most = _ROOM + _BYTES.get(Path(path).suffix.lower(), 4) * len(rows) * (11 + rows.sh[0].size)
    with replacing(path, most=most) as temporary:
        if temporary.suffix.lower() == ".usdz":
            _pack(stage, temporary)
        else:
            stage.GetRootLayer().Export(str(temporary))
    return order if stored.order is None else None


def _stage(rows: Gaussians, stored: Stored) -> Any:
    """The whole stage in memory."""
    from pxr import Gf, Sdf, Usd, UsdGeom, Vt

    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)  # unknown: trained scenes have a scale of their own
    prim = stage.DefinePrim(f"/{SCENE_NODE}", "ParticleField3DGaussianSplat")
    stage.SetDefaultPrim(prim)
    notes = notes_of(stored)
    prim.SetCustomDataByKey(NOTES, text_of(notes))
    x, y, z, w = notes["turn"]
    UsdGeom.Xformable(prim).AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Quatd(w, x, y, z))
    far = _REACH * rows.scales.max(axis=1, keepdims=True).astype(np.float64)
    extent = np.array([(rows.means - far).min(axis=0), (rows.means + far).max(axis=0)])
    quats = unit_quats(rows.quats)[:, [1, 2, 3, 0]]
    kinds = Sdf.ValueTypeNames
    for name, kind, array, values in (
        ("positions", kinds.Point3fArray, Vt.Vec3fArray, rows.means),
        ("orientations", kinds.QuatfArray, Vt.QuatfArray, quats),
        ("scales", kinds.Float3Array, Vt.Vec3fArray, finite_scales(rows.scales)),
        ("opacities", kinds.FloatArray, Vt.FloatArray, rows.opacities),
        ("radiance:sphericalHarmonicsCoefficients", kinds.Float3Array, Vt.Vec3fArray, rows.sh.reshape(-1, 3)),
        ("extent", kinds.Float3Array, Vt.Vec3fArray, np.clip(extent, -3e38, 3e38)),
    ):
        numbers = np.ascontiguousarray(values, np.float32)
        prim.CreateAttribute(name, kind, custom=False).Set(array.FromNumpy(numbers))
    degree = prim.CreateAttribute(
        "radiance:sphericalHarmonicsDegree", kinds.Int, custom=False, variability=Sdf.VariabilityUniform
    )
    degree.Set(rows.sh_degree)
    return stage


def _pack(stage: Any, path: Path) -> None:
    """Write a stage as the only file of an archive."""
    from pxr import Sdf

    with TemporaryDirectory(dir=path.parent, prefix=".unfinished-") as folder:
        inner = Path(folder) / "scene.usdc"
        stage.GetRootLayer().Export(str(inner))
        writer = Sdf.ZipFileWriter.CreateNew(str(path))
        writer.AddFile(str(inner), inner.name)
        writer.Save()
