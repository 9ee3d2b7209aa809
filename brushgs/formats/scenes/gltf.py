"""Gaussians in glTF models: points with the extension KHR_gaussian_splatting, or an earlier draft of it.

Readable files are .glb, and .gltf with data inside or beside it. Nodes place each mesh; the spherical
harmonics of rotated splats are rotated with them. Opacities are 0 to 1. Scales are linear and never negative;
an earlier draft stored logarithms, as splat-transform did until mid-2026, which is detected by a negative
scale. Splats packed as SPZ by Cesium are read too: as in Cesium, their axes are taken as stored and then
placed by the node.

Written files are .glb with points, all numbers as float32. Up is +y in glTF, but any axis in scenes: if the
first view of a scene is known, its node rotates it upright for viewers, and our reader ignores this rotation.
Rows keep their order, but strokes with brushes are sorted by brush.
Sources: Khronos, KHR_gaussian_splatting (release candidate); Cesium's drafts of 2024 and 2025.
"""

import warnings
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from brushgs.errors import SceneError, SceneWarning
from brushgs.formats.files import replacing
from brushgs.formats.gltf_file import CURE, SCENE_NODE, GlbWriter, GltfArray, GltfFile, Model
from brushgs.formats.scenes.columns import Columns, Encoding, check_decoded_size
from brushgs.formats.scenes.placed import NOTES, Part, notes_of, read_notes, rows_of_parts
from brushgs.formats.scenes.rows import Decoder, SceneFile
from brushgs.formats.scenes.spz import open_data
from brushgs.formats.scenes.stored import Stored
from brushgs.formats.scenes.write import brush_order, finite_scales, in_order
from brushgs.formats.schema import shown
from brushgs.values.arrays import F64
from brushgs.values.gaussians import Gaussians
from brushgs.values.notes import Training
from brushgs.values.quats import normalized

_PACKED = (
    "KHR_gaussian_splatting_compression_spz_2",
    "KHR_gaussian_splatting_compression_spz",
    "KHR_spz_gaussian_splats_compression",
)
_MAX_GROWTH = 100  # bytes in memory per byte of a file with packed splats, as for SPZ files


def _open_packed(
    file: GltfFile[Any], extensions: list[tuple[str, Any]], opened: dict[object, SceneFile]
) -> SceneFile | None:
    """The packed splats of a primitive, or None; `opened` caches them, so splats placed twice open once."""
    for name, value in extensions:
        if name in _PACKED:
            if not isinstance(value, dict):
                raise SceneError(file.path, f"{name} must be an object, got {shown(value)}; {CURE}")
            index = value.get("bufferView")
            data, _ = file.view(index, name)  # raises if the index is no number
            if index not in opened:
                opened[index] = open_data(file.path, bytes(data))
            return opened[index]
    return None


EXTENSION = "KHR_gaussian_splatting"
_BLOCK_ROWS = 1 << 13
_MAX_PLAIN_GROWTH = 4  # bytes in memory per byte of a file with plain numbers, which take 1 byte or more


class _Primitive(Struct):
    attributes: dict[str, Any] | None = None
    extensions: dict[str, Any] | None = None


class _Mesh(Struct):
    primitives: list[_Primitive] | None = None

    @property
    def splats(self) -> list[_Primitive]:
        """Primitives that hold splats."""
        named = ((some, " ".join(some.extensions or {})) for some in self.primitives or [])
        return [some for some, names in named if "gaussian_splat" in names]


class _SplatModel(Model):
    """The part of a model that scenes need."""

    meshes: list[_Mesh] | None = None
    textures: Any = None
    extras: Any = None


_File = GltfFile[_SplatModel]


def open_scene(path: Path) -> SceneFile:
    """Read the structure of a glTF model.

    Raises:
        SceneError: if it is damaged, holds no Gaussian splats, or holds them in an unsupported form.
    """
    file = GltfFile(path, _SplatModel)
    unknown: dict[str, None] = {}
    opened: dict[object, SceneFile] = {}
    meshes = _placed_meshes(file)
    notes = file.top.extras.get(NOTES) if isinstance(file.top.extras, dict) else None
    stored, is_ours = read_notes(path, notes, [matrix for _, matrix in meshes])
    parts = (
        _open_splats(file, primitive, np.eye(4) if is_ours else matrix, unknown, opened)
        for mesh, matrix in meshes
        for primitive in mesh.splats
    )
    found = [(part, scene) for part, scene in parts if part.num_rows]
    if not found:
        raise SceneError(path, _why_no_splats(file.top))
    packed = [scene for _, scene in found if scene is not None]
    open_rows = partial(rows_of_parts, [part for part, _ in found], is_whole=bool(packed))
    rows = open_rows()
    growth = _MAX_GROWTH if packed else _MAX_PLAIN_GROWTH
    check_decoded_size(path, rows.num_rows, rows.num_terms, file.size, max_growth=growth)
    name = f"glTF with {EXTENSION}{_packing(found)}"
    return SceneFile(
        path,
        name,
        rows.num_rows,
        rows.num_terms,
        open_rows,
        up=None if is_ours else "+y",  # the glTF standard, which every viewer follows
        training=_training(stored, packed if len(packed) == len(found) else []),
        stored=stored,
        unknown=tuple(dict.fromkeys([*unknown, *(name for scene in packed for name in scene.unknown)])),
    )


def _packing(found: list[tuple[Part, SceneFile | None]]) -> str:
    """A clause about packed splats and logarithmic scales; "" for plain numbers."""
    is_packed = any(scene is not None for _, scene in found)
    are_logs = any(scene is None and part.encoding.scales == "log" for part, scene in found)
    return ", packed as SPZ" * is_packed + ", scales as logarithms" * are_logs


def _placed_meshes(file: _File) -> list[tuple[_Mesh, F64]]:
    """Each mesh of the scene with its matrix [4, 4], world from mesh; the identity if there are no nodes."""
    if not file.top.nodes:
        return [(mesh, np.eye(4)) for mesh in file.top.meshes or []]
    placed = []
    for some in file.placed_nodes():
        if some.node.mesh is None:
            continue
        if "EXT_mesh_gpu_instancing" in (some.node.extensions or {}):
            raise SceneError(file.path, f"repeats a mesh by EXT_mesh_gpu_instancing, not read; {CURE}")
        placed.append((file.item(file.top.meshes, some.node.mesh, "a node refers to meshes"), some.matrix))
    return placed


def _training(stored: Stored, packed: list[SceneFile]) -> Training:
    """How splats were trained: by our notes, or by agreement of the packed scenes."""
    if stored.antialiased:
        return "antialiased"
    trainings = {scene.training for scene in packed}
    return trainings.pop() if len(trainings) == 1 else "default"


class _Attributes:
    """The attributes of a primitive of splats."""

    def __init__(self, file: _File, primitive: _Primitive) -> None:
        if primitive.attributes is None:
            raise SceneError(file.path, f"a primitive of splats has no attributes; {CURE}")
        self._file, self._attributes = file, primitive.attributes

    def find(self, name: str, *widths: int) -> GltfArray | None:
        """An attribute of the standard, of the extension or of an earlier draft, or None.

        Raises SceneError if it does not have one of the widths.
        """
        others = f"{EXTENSION}:{name}", f"_{name}", f"_{name.replace('COEF_', 'COEFF_')}"
        name = next((other for other in others if other in self._attributes), name)
        if name not in self._attributes:
            return None
        array = self._file.array(self._attributes[name], f"attribute {name}")
        if array.width not in widths:
            rule = f"attribute {name} must have {' or '.join(map(str, widths))} numbers a splat"
            raise SceneError(self._file.path, f"{rule}, got {array.width}; {CURE}")
        return array

    def lack(self, name: str) -> NoReturn:
        """Raise SceneError for a missing attribute."""
        raise SceneError(self._file.path, f"a primitive of splats has no attribute {name}; {CURE}")

    def rest(self) -> list[GltfArray]:
        """Coefficients from degree 1 to the first missing degree. Raises SceneError if one is partial."""
        rest: list[GltfArray] = []
        for degree in (1, 2, 3):
            found = [self.find(f"SH_DEGREE_{degree}_COEF_{index}", 3) for index in range(2 * degree + 1)]
            complete = [array for array in found if array is not None]
            if not complete:
                break
            if len(complete) < len(found):
                rule = f"attributes of splats must have all {len(found)} coefficients of degree {degree}"
                raise SceneError(self._file.path, f"{rule}, got {len(complete)}; {CURE}")
            rest += complete
        return rest


def _why_no_splats(top: _SplatModel) -> str:
    """The message about a model without splats, which may be a painting exported for viewing."""
    if str(top.asset.generator).startswith("brushgs ") and top.textures:
        fact = "holds a painting as textured rectangles, which cannot be painted again"
        return f"{fact}; paint the scene it was made of, or 'brushgs cluster SCENE -o FILE.glb'"
    return f"is a glTF model without Gaussian splats; export the splats as .ply, or with {EXTENSION}"


def _open_splats(
    file: _File, primitive: _Primitive, matrix: F64, unknown: dict[str, None], opened: dict[object, SceneFile]
) -> tuple[Part, SceneFile | None]:
    """The splats of one primitive, and the SPZ scene in which they are packed, or None.

    Adds extensions that are not read to `unknown`.
    """
    extensions = primitive.extensions or {}
    own = extensions.get(EXTENSION)
    own = own if isinstance(own, dict) else {}
    inner = own.get("extensions")
    every = [*extensions.items(), *(inner.items() if isinstance(inner, dict) else ())]
    _check_extensions(file, every, own, unknown)
    packed = _open_packed(file, every, opened)
    if packed is not None:
        counts = packed.num_rows, packed.num_terms
        return Part(*counts, partial(_unpacking, packed), Encoding(opacities="linear"), matrix), packed
    return _open_plain(file, _Attributes(file, primitive), matrix), None


def _open_plain(file: _File, attributes: _Attributes, matrix: F64) -> Part:
    """The splats of a primitive whose attributes are plain numbers."""
    find, lack = attributes.find, attributes.lack
    means = find("POSITION", 3) or lack("POSITION")
    quats = find("ROTATION", 4) or lack(f"{EXTENSION}:ROTATION")
    scales = find("SCALE", 3) or lack(f"{EXTENSION}:SCALE")
    fallback, degree_0 = find("COLOR_0", 3, 4), find("SH_DEGREE_0_COEF_0", 3)
    alpha = fallback if fallback is not None and fallback.width == 4 else None
    opacities = find("OPACITY", 1) or alpha or lack(f"{EXTENSION}:OPACITY")
    colors = degree_0 or fallback or lack(f"{EXTENSION}:SH_DEGREE_0_COEF_0")
    rest = attributes.rest()
    for array in (quats, scales, opacities, colors, *rest):
        if array.count != means.count:
            rule = f"attributes of splats must all have {means.count} rows, like POSITION"
            raise SceneError(file.path, f"{rule}, got {array.count}; {CURE}")
    starts = range(0, scales.count, _BLOCK_ROWS)
    are_logs = any((scales.read(start, start + _BLOCK_ROWS) < 0).any() for start in starts)
    encoding = Encoding("log" if are_logs else "linear", "linear", "xyzw", "sh" if degree_0 else "rgb")

    def read(start: int, stop: int, out: Columns) -> None:
        out.means[:] = means.read(start, stop)
        out.quats[:] = quats.read(start, stop)
        out.scales[:] = scales.read(start, stop)
        out.opacities[:] = opacities.read(start, stop)[:, -1]  # the last of four columns is alpha
        out.sh[:, 0] = colors.read(start, stop)[:, :3]
        for term, array in enumerate(rest, start=1):
            out.sh[:, term] = array.read(start, stop)

    return Part(means.count, 1 + len(rest), lambda: read, encoding, matrix)


def _unpacking(packed: SceneFile) -> Decoder:
    """Decompress an SPZ scene; the result decodes its rows."""
    with packed.open_rows().open_decoder() as unpack:  # bytes in memory stay valid after the block
        pass

    def read(start: int, stop: int, out: Columns) -> None:
        found = Columns.empty(stop - start, packed.num_terms)
        unpack(start, stop, found)
        for name in ("means", "quats", "scales", "opacities"):
            getattr(out, name)[:] = getattr(found, name)
        out.sh[:, : packed.num_terms] = found.sh

    return read


def _check_extensions(
    file: _File, every: list[tuple[str, Any]], own: dict[str, Any], unknown: dict[str, None]
) -> None:
    """Refuse other compression, add unread extensions to `unknown`, and warn of linear colors (too dark)."""
    for name, _ in every:
        if "compression" in name and name not in _PACKED:
            fact = f"holds splats compressed by {name[:80]}, which is not read"
            raise SceneError(file.path, f"{fact}; export it without compression, or as .spz or .ply")
        if "gaussian_splat" not in name:
            unknown[name] = None
    if own.get("kernel", "ellipse") != "ellipse":
        unknown[f"kernel {str(own['kernel'])[:40]}"] = None
    if own.get("colorSpace") == "lin_rec709_display":
        message = "was trained in linear colors (lin_rec709_display), which are painted too dark"
        warnings.warn(SceneWarning(f"{file.path}: {message}; lighten it, or train in sRGB"), stacklevel=2)


_POINTS = 0  # mode of a primitive of points


@in_order(brush_order)
def write_scene(rows: Gaussians, path: str | Path, stored: Stored) -> None:
    """Write one primitive of points, with unit rotations; notes go to `extras`.

    Raises:
        ValueError: if the file would have 4 GiB or more, or the names of brushes are too long.
        SceneError: if the file cannot be written.
    """
    notes = notes_of(stored)
    model = GlbWriter()
    model.uses(EXTENSION)
    model.add("meshes", primitives=[_primitive(model, rows)])
    model.add("nodes", mesh=0, name=SCENE_NODE, rotation=notes["turn"])
    model.add("scenes", nodes=[0])
    model.top |= {"scene": 0, "extras": {NOTES: notes}}
    with replacing(path) as temporary, temporary.open("wb") as file:
        model.write(file)


def _columns(rows: Gaussians) -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield the name and the numbers, [n] or [n, width], of each attribute."""
    yield "POSITION", rows.means
    yield f"{EXTENSION}:ROTATION", normalized(rows.quats)[:, [1, 2, 3, 0]]
    yield f"{EXTENSION}:SCALE", finite_scales(rows.scales)
    yield f"{EXTENSION}:OPACITY", rows.opacities
    for degree in range(rows.sh_degree + 1):
        for index in range(2 * degree + 1):
            yield f"{EXTENSION}:SH_DEGREE_{degree}_COEF_{index}", rows.sh[:, degree**2 + index]


def _primitive(model: GlbWriter, rows: Gaussians) -> dict[str, Any]:
    """A primitive of points with an accessor per attribute; the standard requires bounds of positions."""
    attributes = {
        name: model.accessor(column.astype(np.float32), "vertices", has_bounds=name == "POSITION")
        for name, column in _columns(rows)
    }
    own = {"kernel": "ellipse", "colorSpace": "srgb_rec709_display", "projection": "perspective"}
    own["sortingMethod"] = "cameraDistance"
    return {"mode": _POINTS, "attributes": attributes, "extensions": {EXTENSION: own}}
