"""The table of camera formats. To add one: write a module beside this one, and its line here.

A format that is JSON is recognised by its fields, any other one by its path. Error texts, help
texts and the fuzzer read this table.
"""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from brushgs.options.table import listed

COLMAP_FILES = tuple(
    stem + suffix for stem in ("cameras", "images", "points3D") for suffix in (".bin", ".txt")
)


class CameraFormat(NamedTuple):
    """A format of camera files.

    Attributes:
        name: in words, for help and error texts.
        reader: module of this package with `read(path, content) -> CameraFile`, or "module:function";
            `content` are the bytes of a JSON file, None where `matches_path` recognised it.
        file: a usual name of such a file.
        matches_path: whether a path is of this format; None if only its fields show it.
        key: a field that JSON of this format has, "" for a list; None if it is no JSON.
    """

    name: str
    reader: str
    file: str
    matches_path: Callable[[Path], bool] | None = None
    key: str | None = None


def has_suffix(*suffixes: str) -> Callable[[Path], bool]:
    """Recognises files by their name."""
    return lambda path: path.suffix.lower() in suffixes


def is_colmap(path: Path) -> bool:
    """Recognises the folder of a COLMAP model, and its files by their names."""
    try:
        return path.name in COLMAP_FILES or path.is_dir()
    except OSError:  # a name that no folder can have
        return False


CAMERA_FORMATS = (
    CameraFormat(
        "cameras.json of a 3DGS training",
        "views:read_trained",
        "cameras.json",
        key="",
    ),
    CameraFormat(
        "camera_path.json of the nerfstudio viewer",
        "views:read_path",
        "camera_path.json",
        key="camera_path",
    ),
    CameraFormat(
        "transforms.json of NeRF and nerfstudio",
        "views:read_transforms",
        "transforms.json",
        key="frames",
    ),
    CameraFormat(
        "glTF (.glb, .gltf)",
        "gltf",
        "cameras.glb",
        matches_path=has_suffix(".glb", ".gltf"),
    ),
    CameraFormat(
        "USD (.usd, .usda, .usdc, .usdz; needs the package usd-core)",
        "usd",
        "cameras.usda",
        matches_path=has_suffix(".usd", ".usda", ".usdc", ".usdz"),
    ),
    CameraFormat(
        "a COLMAP sparse model",
        "colmap",
        "images.bin",
        matches_path=is_colmap,
    ),
)
# What is not read, though it may hold cameras: suffix -> what it is.
UNREAD_CAMERAS = {
    ".abc": "an Alembic scene",
    ".blend": "a Blender file",
    ".dae": "a Collada scene",
    ".fbx": "an FBX scene",
}
# What may lie beside a scene, where trainers and captures keep cameras: files, and the folder of a model.
FILES_BESIDE, MODEL_BESIDE = ("cameras.json", "transforms.json", "transforms_train.json"), "sparse/0"
BESIDE_READ = listed([*FILES_BESIDE, MODEL_BESIDE])
# For help and error texts, in the order of the table.
CAMERAS_READ = listed([row.name for row in CAMERA_FORMATS])
