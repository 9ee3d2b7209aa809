"""Gaussians in glTF models: points with the extension KHR_gaussian_splatting, or an earlier draft of it.

Read are .glb files and .gltf files with data inside or beside them. Every mesh is placed by its nodes;
rotated splats have their spherical harmonics rotated with them. Opacities are 0 to 1. Scales are linear and
never negative; an earlier draft stored logarithms, as splat-transform did until mid-2026: negative ones tell.
Splats packed as SPZ, as Cesium writes them, are read too: their axes are taken as they are stored and then
placed by the node, as Cesium does.
Sources: Khronos, KHR_gaussian_splatting (release candidate); Cesium's drafts of 2024 and 2025.
"""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import Struct

from brushgs.errors import SceneError, SceneWarning
from brushgs.formats.gltf_file import CURE, Extensions, GltfArray, GltfFile, Model, placed_nodes
from brushgs.formats.scenes.columns import (
    Columns,
    Encoding,
    Scales,
    check_decoded_size,
)
from brushgs.formats.scenes.placed import NOTES, Placement, is_turned_by, read_notes
from brushgs.formats.scenes.rows import Decoder, RowSource, SceneFile, decoder_of_parts
from brushgs.formats.scenes.spz import open_data
from brushgs.formats.scenes.stored import Stored
from brushgs.formats.schema import shown
from brushgs.values.arrays import F64
from brushgs.values.notes import Training

NAMES = (
    "KHR_gaussian_splatting_compression_spz_2",
    "KHR_gaussian_splatting_compression_spz",
    "KHR_spz_gaussian_splats_compression",
)
MAX_GROWTH = 100  # bytes in memory per byte of a file: as of SPZ files


@dataclass(frozen=True)
class PackedSplats:
    """One primitive of splats packed as SPZ, placed by one node.

    Attributes:
        scene: the SPZ scene inside the model.
        placement: where the node puts it.
    """

    scene: SceneFile
    placement: Placement

    @property
    def num_rows(self) -> int:
        """Gaussians that it holds."""
        return self.scene.num_rows

    @property
    def num_terms(self) -> int:
        """Spherical-harmonic terms of each."""
        return self.scene.num_terms

    def decoder(self) -> Decoder:
        """Decodes rows to the standard layout, placed in the world."""
        with self.scene.open_rows().open_decoder() as unpack:  # of bytes in memory: nothing is closed
            pass

        def decode(start: int, stop: int, out: Columns) -> None:
            found = Columns.empty(stop - start, self.num_terms)
            unpack(start, stop, found)
            found.standardize(Encoding(opacities="linear"))
            for name in ("means", "quats", "scales", "opacities"):
                getattr(out, name)[:] = getattr(found, name)
            out.sh[:, : self.num_terms] = found.sh
            out.sh[:, self.num_terms :] = 0
            self.placement.apply(out, self.num_terms)

        return decode


def open_packed(
    file: GltfFile[Any],
    extensions: Iterator[tuple[str, Any]],
    placement: Placement,
    opened: dict[object, SceneFile],
) -> PackedSplats | None:
    """The packed splats of a primitive, or None if it has none.

    Args:
        file: the model.
        extensions: of the primitive, by name.
        placement: where its node puts it.
        opened: scenes by number of their buffer view, so that one that is placed twice is opened once.

    Raises:
        SceneError: if they are damaged.
    """
    for name, value in extensions:
        if name in NAMES:
            if not isinstance(value, dict):
                raise SceneError(file.path, f"{name} must be an object, got {shown(value)}; {CURE}")
            index = value.get("bufferView")
            data, _ = file.view(index, name)  # refuses what is no number
            if index not in opened:
                opened[index] = open_data(file.path, bytes(data))
            return PackedSplats(opened[index], placement)
    return None


EXTENSION = "KHR_gaussian_splatting"
_BLOCK_ROWS = 1 << 13
_MAX_PLAIN_GROWTH = 4  # bytes in memory per byte of a file, where numbers have one byte


class _Primitive(Struct):
    attributes: dict[str, Any] | None = None
    extensions: Extensions | None = None


class _Mesh(Struct):
    primitives: list[_Primitive] | None = None

    @property
    def splats(self) -> list[_Primitive]:
        """Primitives that hold splats."""
        primitives = self.primitives or []
        return [
            some for some in primitives if any("gaussian_splat" in name for name in some.extensions or {})
        ]


class _SplatModel(Model):
    """What of a model scenes need."""

    meshes: list[_Mesh] | None = None
    textures: Any = None
    extras: Any = None


_File = GltfFile[_SplatModel]


@dataclass(frozen=True)
class _Splats:
    """One primitive of splats, placed by one node.

    Attributes:
        means: accessor of the centres, as are the others of what their names say.
        quats: x, y, z, w.
        scales: linear, or logarithms where `are_scales_logs`.
        opacities: 0 to 1; of four columns the last counts.
        colors: coefficients of degree 0, or display colours where `are_colors_rgb`.
        rest: coefficients of the higher degrees, one accessor for each.
        placement: where the node puts them.
    """

    means: GltfArray
    quats: GltfArray
    scales: GltfArray
    opacities: GltfArray
    colors: GltfArray
    rest: tuple[GltfArray, ...]
    are_colors_rgb: bool
    are_scales_logs: bool
    placement: Placement

    @property
    def num_rows(self) -> int:
        """Gaussians that it holds."""
        return len(self.means.values)

    @property
    def num_terms(self) -> int:
        """Spherical-harmonic terms of each."""
        return 1 + len(self.rest)

    @property
    def encoding(self) -> Encoding:
        """What its numbers mean."""
        scales: Scales = "log" if self.are_scales_logs else "linear"
        return Encoding(scales, "linear", "xyzw", "rgb" if self.are_colors_rgb else "sh")

    def decoder(self) -> Decoder:
        """Decodes rows to the standard layout, placed in the world."""

        def decode(start: int, stop: int, out: Columns) -> None:
            out.means[:] = self.means.read(start, stop)
            out.quats[:] = self.quats.read(start, stop)
            out.scales[:] = self.scales.read(start, stop)
            out.opacities[:] = self.opacities.read(start, stop)[:, -1]
            out.sh[:, 0] = self.colors.read(start, stop)[:, :3]
            for term, array in enumerate(self.rest, start=1):
                out.sh[:, term] = array.read(start, stop)
            out.sh[:, self.num_terms :] = 0
            out.standardize(self.encoding)
            self.placement.apply(out, self.num_terms)

        return decode


def open_scene(path: Path) -> SceneFile:
    """Read the structure of a glTF model.

    Raises:
        SceneError: if it is damaged, holds no Gaussian splats, or holds them in a way that is not read.
    """
    file = GltfFile(path, _SplatModel)
    unknown: dict[str, None] = {}
    opened: dict[object, SceneFile] = {}
    placed, stored, is_ours = _placed_and_stored(file)
    splats = [
        some
        for mesh, matrix in placed
        for primitive in mesh.splats
        if (some := _open_splats(file, primitive, Placement(matrix), unknown, opened)).num_rows
    ]
    if not splats:
        raise SceneError(path, _why_no_splats(file.top))
    num_rows = sum(some.num_rows for some in splats)
    num_terms = max(some.num_terms for some in splats)
    packed = [some.scene for some in splats if isinstance(some, PackedSplats)]
    check_decoded_size(
        path, num_rows, num_terms, file.size, max_growth=MAX_GROWTH if packed else _MAX_PLAIN_GROWTH
    )

    def open_rows() -> RowSource:
        open_decoder = decoder_of_parts([(some.num_rows, some.decoder) for some in splats])
        is_whole = bool(packed)
        return RowSource(num_rows, num_terms, open_decoder, _BLOCK_ROWS, is_logit=True, is_whole=is_whole)

    return SceneFile(
        path=path,
        format=_format(splats),
        num_rows=num_rows,
        num_terms=num_terms,
        open_rows=open_rows,
        up=None if is_ours else "+y",  # by the standard of glTF, which every viewer follows
        training=_training(stored, packed, is_packed=len(packed) == len(splats)),
        stored=stored,
        unknown=tuple(dict.fromkeys([*unknown, *(name for scene in packed for name in scene.unknown)])),
    )


def _format(splats: "list[_Splats | PackedSplats]") -> str:
    """What the model holds, in words."""
    packed = ", packed as SPZ" if any(isinstance(some, PackedSplats) for some in splats) else ""
    are_logs = any(isinstance(some, _Splats) and some.are_scales_logs for some in splats)
    return f"glTF with {EXTENSION}{packed}{', scales as logarithms' if are_logs else ''}"


def _placed_meshes(file: _File) -> list[tuple[_Mesh, F64]]:
    """Each mesh of the scene with its matrix [4, 4], world from mesh; all meshes as they are without nodes.

    Raises:
        SceneError: if nodes are missing, form a ring, or place very many meshes.
    """
    if not file.top.nodes:
        return [(mesh, np.eye(4)) for mesh in file.top.meshes or []]
    placed = []
    for some in placed_nodes(file):
        if some.node.mesh is None:
            continue
        if "EXT_mesh_gpu_instancing" in (some.node.extensions or {}):
            raise SceneError(file.path, f"repeats a mesh by EXT_mesh_gpu_instancing, not read; {CURE}")
        placed.append((file.item(file.top.meshes, some.node.mesh, "a node refers to meshes"), some.matrix))
    return placed


def _placed_and_stored(file: _File) -> tuple[list[tuple[_Mesh, F64]], Stored, bool]:
    """Meshes with their matrices, what the model records, and whether that fits: it is as we wrote it.

    Then the turn of its node, which the notes state, is taken back.
    """
    placed = _placed_meshes(file)
    extras = file.top.extras
    stored, turn = read_notes(file.path, extras.get(NOTES) if isinstance(extras, dict) else None)
    if turn is None:
        return placed, stored, False
    if len(placed) == 1 and is_turned_by(placed[0][1], turn):
        return [(placed[0][0], np.eye(4))], stored, True
    # Something else was added, or it was moved.
    return placed, stored._replace(first_view=None, counts=None, brushes=()), False


def _training(stored: Stored, packed: list[SceneFile], *, is_packed: bool) -> Training:
    """How splats were trained: by our notes, or as all packed ones state."""
    if stored.antialiased:
        return "antialiased"
    trainings = {scene.training for scene in packed}
    return next(iter(trainings)) if is_packed and len(trainings) == 1 else "default"


class _Attributes:
    """The attributes of a primitive of splats."""

    def __init__(self, file: _File, primitive: _Primitive) -> None:
        if primitive.attributes is None:
            raise SceneError(file.path, f"a primitive of splats has no attributes; {CURE}")
        self._file, self._attributes = file, primitive.attributes

    def find(self, name: str, *widths: int) -> GltfArray | None:
        """An attribute by its full name. Raises SceneError if it has not as many numbers a row as it must."""
        if name not in self._attributes:
            return None
        array = self._file.array(self._attributes[name], f"attribute {name}")
        if array.width not in widths:
            rule = f"attribute {name} must have {' or '.join(map(str, widths))} numbers a splat"
            raise SceneError(self._file.path, f"{rule}, got {array.width}; {CURE}")
        return array

    def find_own(self, name: str, width: int) -> GltfArray | None:
        """An attribute of the extension, in any draft of it."""
        return self.find(f"{EXTENSION}:{name}", width) or self.find(f"_{name}", width)

    def require(self, name: str, *choices: GltfArray | None) -> GltfArray:
        """The first that is there. Raises SceneError if none is."""
        found = next((choice for choice in choices if choice is not None), None)
        if found is None:
            raise SceneError(self._file.path, f"a primitive of splats has no attribute {name}; {CURE}")
        return found

    def rest(self) -> tuple[GltfArray, ...]:
        """The coefficients of degree 1 and more, as far as degrees are complete."""
        rest: list[GltfArray] = []
        for degree in (1, 2, 3):
            names = [f"SH_DEGREE_{degree}_COEF_{index}" for index in range(2 * degree + 1)]
            found = [
                self.find_own(name, 3) or self.find_own(name.replace("COEF_", "COEFF_"), 3) for name in names
            ]
            complete = [array for array in found if array is not None]
            if complete and len(complete) < len(names):
                rule = f"attributes of splats must have all {len(names)} coefficients of degree {degree}"
                raise SceneError(self._file.path, f"{rule}, got {len(complete)}; {CURE}")
            if not complete:
                break
            rest += complete
        return tuple(rest)


def _why_no_splats(top: _SplatModel) -> str:
    """The sentence about a model without any, which may be a painting that was exported to be looked at."""
    if str(top.asset.generator).startswith("brushgs ") and top.textures:
        fact = "holds a painting as textured rectangles, which cannot be painted again"
        return (
            f"{fact}; paint the scene it was made of, or write that with 'brushgs cluster SCENE -o FILE.glb'"
        )
    return f"is a glTF model without Gaussian splats; export the splats as .ply, or with {EXTENSION}"


def _open_splats(
    file: _File,
    primitive: _Primitive,
    placement: Placement,
    unknown: dict[str, None],
    opened: dict[object, SceneFile],
) -> "_Splats | PackedSplats":
    """The data of one primitive.

    Args:
        file: the model.
        primitive: one that holds splats.
        placement: where its node puts it.
        unknown: extensions that are not read are added here.
        opened: see `open_packed`.
    """
    _check_extensions(file, primitive, unknown)
    packed = open_packed(file, _extensions(primitive), placement, opened)
    if packed is not None:
        return packed
    attributes = _Attributes(file, primitive)
    means = attributes.require("POSITION", attributes.find("POSITION", 3))
    quats, scales = (
        attributes.require(f"{EXTENSION}:{name}", attributes.find_own(name, width))
        for name, width in (("ROTATION", 4), ("SCALE", 3))
    )
    fallback = attributes.find("COLOR_0", 3, 4)
    alpha = fallback if fallback is not None and fallback.width == 4 else None
    opacities = attributes.require(f"{EXTENSION}:OPACITY", attributes.find_own("OPACITY", 1), alpha)
    degree_0 = attributes.find_own("SH_DEGREE_0_COEF_0", 3)
    colors = attributes.require(f"{EXTENSION}:SH_DEGREE_0_COEF_0", degree_0, fallback)
    rest = attributes.rest()
    for array in (quats, scales, opacities, colors, *rest):
        if array.count != means.count:
            rule = f"attributes of splats must all have {means.count} rows, like POSITION"
            raise SceneError(file.path, f"{rule}, got {array.count}; {CURE}")
    return _Splats(
        means=means,
        quats=quats,
        scales=scales,
        opacities=opacities,
        colors=colors,
        rest=rest,
        are_colors_rgb=degree_0 is None,
        are_scales_logs=any(
            (scales.read(start, start + _BLOCK_ROWS) < 0).any()
            for start in range(0, scales.count, _BLOCK_ROWS)
        ),
        placement=placement,
    )


def _extensions(primitive: _Primitive) -> Iterator[tuple[str, Any]]:
    """Extensions of a primitive, and those within its extension for splats."""
    found = primitive.extensions or {}
    yield from found.items()
    own = found.get(EXTENSION)
    if isinstance(own, dict) and isinstance(own.get("extensions"), dict):
        yield from own["extensions"].items()


def _check_extensions(file: _File, primitive: _Primitive, unknown: dict[str, None]) -> None:
    """Refuse other compression, and warn of linear colours, which the strokes would show too dark."""
    for name, _ in _extensions(primitive):
        if "compression" in name and name not in NAMES:
            fact = f"holds splats compressed by {name[:80]}, which is not read"
            raise SceneError(file.path, f"{fact}; export it without compression, or as .spz or .ply")
        if "gaussian_splat" not in name:
            unknown[name] = None
    own = (primitive.extensions or {}).get(EXTENSION)
    if isinstance(own, dict):
        if own.get("kernel", "ellipse") != "ellipse":
            unknown[f"kernel {str(own['kernel'])[:40]}"] = None
        if own.get("colorSpace") == "lin_rec709_display":
            message = "was trained in linear colours (lin_rec709_display), which are painted too dark"
            warnings.warn(SceneWarning(f"{file.path}: {message}; lighten it, or train in sRGB"), stacklevel=2)
