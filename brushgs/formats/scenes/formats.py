"""The table of scene formats. To add one: write a module beside this one, and its line here.

Its content decides of which format a file is, where the format allows that, and not its name. Error texts,
help texts and the fuzzer read this table.
"""

from typing import NamedTuple

from brushgs.formats.formats import (
    Matcher,
    any_of,
    begins_with,
    has_suffix,
    is_json_with,
    is_zip_with,
    suffixes_of,
)
from brushgs.formats.scenes.unmarked import is_ksplat, is_splat
from brushgs.options.page import QUAD_SUFFIXES
from brushgs.options.table import listed


class SceneFormat(NamedTuple):
    """A format of scene files.

    Attributes:
        name: as a sentence has it after an article, "a PLY file".
        suffixes: of its files, in lower case, the usual one first; the suffix decides what is written.
        matches: whether a path with these first bytes is of this format; a folder has no first bytes.
        reader: module of this package with `open_scene(path) -> SceneFile`; None if it is not read.
        writer: module of this package with `write_scene(gaussians, path, known: Stored)`; it returns the
            rows in the order of the file, None where that is theirs. None if the format is not written.
        note: which files of this format are read, for help texts.
        written: the suffixes that are written, where these are not all.
        rounds: whether what is written is rounded beyond float32, so that its error is worth telling.
        has_levels: whether it may hold a scene in several levels of detail: its reader has
            `open_scene(path, lod)`, the level or None for its default.
    """

    name: str
    suffixes: tuple[str, ...]
    matches: Matcher
    reader: str | None = None
    writer: str | None = None
    note: str = ""
    written: tuple[str, ...] = ()
    rounds: bool = False
    has_levels: bool = False


KNOWN_SCENES = (
    SceneFormat(
        "PLY file",
        (".ply",),
        begins_with(b"ply\n", b"ply\r"),
        reader="ply",
        writer="ply_write",
        note="as 3DGS trainers write it, or compressed by PlayCanvas or SuperSplat",
    ),
    # Read as any other PLY file: only its name tells what is to be written.
    SceneFormat(
        "compressed PLY file",
        (".compressed.ply",),
        any_of(),
        writer="ply_compressed_write",
        rounds=True,
    ),
    SceneFormat(
        "SPZ scene",
        (".spz",),
        begins_with(b"\x1f\x8b", b"NGSP"),
        reader="spz",
        writer="spz_write",
        note="versions 1 to 4",
        rounds=True,
    ),
    SceneFormat(
        "streamed SOG scene",
        (".json",),
        is_json_with("lodLevels", "filenames", file="lod-meta.json"),
        reader="streamed",
        note="lod-meta.json of a streamed SOG, one level of it",
        has_levels=True,
    ),
    SceneFormat(
        "SOG scene",
        (".sog",),
        any_of(is_zip_with("meta.json", ".sog"), is_json_with("means", "files", file="meta.json")),
        reader="sog",
        writer="sog_write",
        note="version 1 or 2: the archive, its folder or its meta.json",
        rounds=True,
    ),
    SceneFormat(
        "glTF model",
        (".glb", ".gltf"),
        any_of(begins_with(b"glTF"), is_json_with("asset", "meshes"), has_suffix(".gltf")),
        reader="gltf",
        writer="gltf_write",
        note="or .gltf, with KHR_gaussian_splatting",
        written=(".glb",),
    ),
    SceneFormat(
        "USD stage",
        (".usd", ".usda", ".usdc", ".usdz"),
        any_of(begins_with(b"PXR-USDC", b"#usda "), is_zip_with(".usdc", ".usdz")),
        reader="usd",
        writer="usd_write",
        note="with ParticleField3DGaussianSplat, by the package usd-core",
    ),
    SceneFormat(".ksplat scene", (".ksplat",), is_ksplat, reader="ksplat", note="compression levels 0 to 2"),
    # The last of those that are read: it has no mark of its own.
    SceneFormat(
        ".splat scene",
        (".splat",),
        is_splat,
        reader="splat",
        writer="splat_write",
        note="32 bytes a Gaussian",
        rounds=True,
    ),
    # Not read: what is known of them helps to say what a file is.
    SceneFormat(".lcc scene", (".lcc",), has_suffix(".lcc")),
)
SCENE_FORMATS = tuple(row for row in KNOWN_SCENES if row.reader)
WRITTEN_SCENES = tuple(
    row._replace(suffixes=row.written or row.suffixes) for row in KNOWN_SCENES if row.writer
)
SCENE_SUFFIXES = suffixes_of(WRITTEN_SCENES)  # that a scene may be written to
# That the strokes of a painting are exported to; a .glb has them as textured rectangles.
STROKE_SUFFIXES = tuple(suffix for suffix in SCENE_SUFFIXES if suffix not in QUAD_SUFFIXES)
# ".ply (as 3DGS trainers write it, ...)": for help texts.
SCENES_READ = listed([f"{row.suffixes[0]} ({row.note})" for row in SCENE_FORMATS])
