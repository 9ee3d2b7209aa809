"""Gaussians in USD stages: prims of the type ParticleField3DGaussianSplat, of USD 26.03 and newer.

Scales and opacities are linear, as float32 or float16. Each prim is placed by its xform; animated values are
read at their first sample time. Written stages have one prim, all numbers as float32. Up is +y in the stage,
but any axis in scenes: if the first view of a scene is known, the prim rotates it upright, as the node of a
.glb does. Rows keep their order, but strokes with brushes are sorted by brush. Source: OpenUSD, UsdVol.
"""

import json
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.files import replacing
from brushgs.formats.gltf_file import SCENE_NODE
from brushgs.formats.scenes.columns import Columns, Encoding, check_decoded_size
from brushgs.formats.scenes.placed import NOTES, Part, notes_of, read_notes, rows_of_parts
from brushgs.formats.scenes.rows import SceneFile
from brushgs.formats.scenes.stored import MAX_TEXT, Stored, text_of
from brushgs.formats.scenes.write import brush_order, finite_scales, in_order
from brushgs.formats.schema import parse_json
from brushgs.formats.usd import INSTALL, TYPE, Answer, is_usd_here, reading
from brushgs.values.gaussians import Gaussians
from brushgs.values.notes import Training
from brushgs.values.quats import normalized

_ENCODING = Encoding("linear", "linear", "xyzw", "sh")
# Bytes in memory per byte of a file: numbers may have 2 bytes, and USD compresses repeated ones.
_MAX_GROWTH = 20


def open_scene(path: Path) -> SceneFile:
    """Read the splats of a stage.

    Raises SceneError if the package usd-core is missing, the stage is damaged, or it holds no splats.
    """
    with reading(path, "splats") as answer:
        parts = [_open_part(path, answer, index) for index in range(len(answer.header["parts"]))]
        up, notes = answer.header["up"], [part["notes"] for part in answer.header["parts"]]
    if not parts:
        cure = "export the splats as .ply or .usdc of USD 26.03"
        raise SceneError(path, f"is a USD stage without Gaussian splats ({TYPE}); {cure}")
    stored, is_ours = read_notes(path, _parsed(notes[0]), [part.matrix for part in parts])
    if is_ours:
        parts = [replace(parts[0], matrix=np.eye(4))]
    open_rows = partial(rows_of_parts, parts, is_whole=True)
    rows = open_rows()
    counts = rows.num_rows, rows.num_terms
    check_decoded_size(path, *counts, path.stat().st_size, max_growth=_MAX_GROWTH)
    up = None if is_ours or up is None else f"+{up.lower()}"
    training: Training = "antialiased" if stored.antialiased else "default"
    return SceneFile(path, f"USD with {TYPE}", *counts, open_rows, up=up, training=training, stored=stored)


def _open_part(path: Path, answer: Answer, index: int) -> Part:
    matrix = answer.array(f"matrix_{index}")
    if not np.isfinite(matrix).all():
        raise SceneError(path, "its prims scale beyond all numbers; export it again")
    columns = {name: answer.array(f"{name}_{index}") for name in ("means", "quats", "scales", "opacities")}
    sh = answer.array(f"sh_{index}")
    num_terms = sh.shape[1]

    def read(start: int, stop: int, out: Columns) -> None:
        for name, column in columns.items():
            getattr(out, name)[:] = column[start:stop]
        out.sh[:, :num_terms] = sh[start:stop]

    return Part(len(sh), num_terms, lambda: read, _ENCODING, matrix)


def _parsed(notes: str | None) -> object:
    """The JSON object in the notes of a prim; None if there is none, or it is too long or no JSON."""
    try:
        return None if notes is None or len(notes) > MAX_TEXT else parse_json(notes)
    except (json.JSONDecodeError, RecursionError):
        return None


# Most bytes per number if not 4: .usda is text, .usdz needs room for the archive and its member. Free space
# is checked before, because OpenUSD raises an error of its own if the disk is full.
_BYTES = {".usda": 16, ".usdz": 8}
_ROOM = 1 << 16  # bytes for notes and the rest
_REACH = 3  # standard deviations included in the extent of the prim


@in_order(brush_order)
def write_scene(rows: Gaussians, path: str | Path, stored: Stored) -> None:
    """Write one prim of splats, with unit rotations; notes go to its `customData`.

    The suffix decides between text (.usda), an archive (.usdz) and binary.

    Raises:
        ValueError: if the names of brushes are too long.
        SceneError: if the package usd-core is missing, or the file cannot be written.
    """
    if not is_usd_here():
        raise SceneError(path, f"is a USD file, which the package usd-core writes; install it with {INSTALL}")
    stage = _stage(rows, stored)
    most = _ROOM + _BYTES.get(Path(path).suffix.lower(), 4) * len(rows) * (11 + rows.sh[0].size)
    with replacing(path, most=most) as temporary:
        if temporary.suffix.lower() == ".usdz":
            _pack(stage, temporary)
        else:
            stage.GetRootLayer().Export(str(temporary))


def _stage(rows: Gaussians, stored: Stored) -> Any:
    """Build the stage in memory."""
    from pxr import Gf, Sdf, Usd, UsdGeom, Vt

    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)  # unknown: trained scenes have an arbitrary scale
    prim = stage.DefinePrim(f"/{SCENE_NODE}", TYPE)
    stage.SetDefaultPrim(prim)
    notes = notes_of(stored)
    prim.SetCustomDataByKey(NOTES, text_of(notes))
    x, y, z, w = notes["turn"]
    UsdGeom.Xformable(prim).AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Quatd(w, x, y, z))
    far = _REACH * rows.scales.max(axis=1, keepdims=True).astype(np.float64)
    extent = np.array([(rows.means - far).min(axis=0), (rows.means + far).max(axis=0)])
    quats = normalized(rows.quats)[:, [1, 2, 3, 0]]
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
    degree = "radiance:sphericalHarmonicsDegree", kinds.Int, False, Sdf.VariabilityUniform
    prim.CreateAttribute(*degree).Set(rows.sh_degree)
    return stage


def _pack(stage: Any, path: Path) -> None:
    """Write a stage as the only member of an archive."""
    from pxr import Sdf

    with TemporaryDirectory(dir=path.parent, prefix=".unfinished-") as folder:
        inner = Path(folder) / "scene.usdc"
        stage.GetRootLayer().Export(str(inner))
        writer = Sdf.ZipFileWriter.CreateNew(str(path))
        writer.AddFile(str(inner), inner.name)
        writer.Save()
