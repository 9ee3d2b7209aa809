"""Gaussians become a .glb model: points with the extension KHR_gaussian_splatting, all numbers as float32.

glTF points +y up, and scenes do not: where the first view of a scene is known, its node turns it upright for
viewers. The numbers stay as they are, and our reader takes them so. Rows keep their order, but for strokes
with brushes, which are sorted by these. Source: Khronos, KHR_gaussian_splatting (release candidate).
"""

import json
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.io.files import replacing
from brushgs.io.gltf_file import BINARY_CHUNK, JSON_CHUNK
from brushgs.io.scene_node import SCENE_NODE
from brushgs.io.scenes.finite_logs import finite_scales, unit_quats
from brushgs.io.scenes.gltf import EXTENSION
from brushgs.io.scenes.order import brush_order
from brushgs.io.scenes.stored import Stored
from brushgs.io.scenes.upright_notes import NOTES, notes_of
from brushgs.scene import FirstView, Gaussians
from brushgs.version import __version__

_TYPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
_FLOAT, _POINTS = 5126, 0
_MOST_BYTES = (1 << 32) - 1  # of a .glb, whose lengths have 32 bits
_HEADER, _CHUNK = struct.Struct("<4sII"), struct.Struct("<II")


def write_scene(
    gaussians: Gaussians,
    path: str | Path,
    *,
    is_strokes: bool = False,
    scene: str | None = None,
    first_view: FirstView | None = None,
    brushes: Sequence[str] = (),
) -> NDArray[np.int64] | None:
    """Write one primitive of points, and what is recorded as `extras`.

    Arguments as in `brushgs.io.scenes.write.write_scene`. Rotations are written with length 1.

    Returns:
        The rows in the order of the file; None if it is theirs, or recorded.

    Raises:
        ValueError: if the file would have 4 GiB or more, or the names of brushes are too long.
        SceneError: if the file cannot be written.
    """
    order = brush_order(gaussians)
    rows = gaussians if order is None else gaussians.take(order)
    stored = Stored.of(
        rows, is_strokes=is_strokes, scene=scene, first_view=first_view, brushes=brushes, order=order
    )
    notes = notes_of(stored)
    widths = {name: column[0].size for name, column in _columns(rows.take(slice(0, 1)))}
    sizes = [4 * len(rows) * width for width in widths.values()]
    starts = np.cumsum([0, *sizes]).tolist()
    model = {
        "asset": {"version": "2.0", "generator": f"brushgs {__version__}"},
        "extensionsUsed": [EXTENSION],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": SCENE_NODE, "rotation": notes["turn"]}],
        "meshes": [{"primitives": [_primitive(widths)]}],
        "accessors": [
            _accessor(index, name, width, rows) for index, (name, width) in enumerate(widths.items())
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": size}
            for start, size in zip(starts, sizes, strict=False)
        ],
        "buffers": [{"byteLength": starts[-1]}],
        "extras": {NOTES: notes},
    }
    text = json.dumps(model, separators=(",", ":"), allow_nan=False).encode("ascii")
    text += b" " * (-len(text) % 4)
    total = _HEADER.size + 2 * _CHUNK.size + len(text) + starts[-1]
    if total > _MOST_BYTES:
        raise ValueError(
            f"save: a .glb must have less than 4 GiB, got {total / 2**30:.1f} for {len(rows):,} Gaussians; "
            "write a .ply or .sog"
        )
    with replacing(path) as temporary, temporary.open("wb") as file:
        file.write(_HEADER.pack(b"glTF", 2, total))
        file.write(_CHUNK.pack(len(text), JSON_CHUNK) + text)
        file.write(_CHUNK.pack(starts[-1], BINARY_CHUNK))
        for _, column in _columns(rows):
            file.write(np.ascontiguousarray(column, "<f4").tobytes())
    return order if stored.order is None else None


def _columns(rows: Gaussians) -> Iterator[tuple[str, NDArray[Any]]]:
    """Name and numbers of each attribute, [n] or [n, width]; one at a time in memory."""
    yield "POSITION", rows.means
    yield f"{EXTENSION}:ROTATION", unit_quats(rows.quats)[:, [1, 2, 3, 0]]
    yield f"{EXTENSION}:SCALE", finite_scales(rows.scales)
    yield f"{EXTENSION}:OPACITY", rows.opacities
    for degree in range(rows.sh_degree + 1):
        for index in range(2 * degree + 1):
            yield f"{EXTENSION}:SH_DEGREE_{degree}_COEF_{index}", rows.sh[:, degree**2 + index]


def _primitive(names: Sequence[str] | dict[str, int]) -> dict[str, Any]:
    """The points, with an accessor for each attribute."""
    own = {
        "kernel": "ellipse",
        "colorSpace": "srgb_rec709_display",
        "projection": "perspective",
        "sortingMethod": "cameraDistance",
    }
    attributes = {name: index for index, name in enumerate(names)}
    return {"mode": _POINTS, "attributes": attributes, "extensions": {EXTENSION: own}}


def _accessor(index: int, name: str, width: int, rows: Gaussians) -> dict[str, Any]:
    """The description of one attribute; the standard asks for the bounds of positions."""
    accessor = {
        "bufferView": index,
        "componentType": _FLOAT,
        "count": len(rows),
        "type": _TYPES[width],
    }
    if name == "POSITION":
        means = rows.means.astype(np.float32)
        accessor |= {"min": means.min(axis=0).tolist(), "max": means.max(axis=0).tolist()}
    return accessor
