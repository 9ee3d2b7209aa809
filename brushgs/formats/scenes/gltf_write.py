"""Gaussians become a .glb model: points with the extension KHR_gaussian_splatting, all numbers as float32.

glTF points +y up, and scenes do not: where the first view of a scene is known, its node turns it upright for
viewers. The numbers stay as they are, and our reader takes them so. Rows keep their order, but for strokes
with brushes, which are sorted by these. Source: Khronos, KHR_gaussian_splatting (release candidate).
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.formats.files import replacing
from brushgs.formats.gltf_file import SCENE_NODE, GlbWriter
from brushgs.formats.scenes.gltf import EXTENSION
from brushgs.formats.scenes.placed import NOTES, notes_of
from brushgs.formats.scenes.stored import NOTHING, Stored
from brushgs.formats.scenes.write import brush_order, finite_scales, unit_quats
from brushgs.values.gaussians import Gaussians

POINTS = 0  # the mode of a primitive


def write_scene(
    gaussians: Gaussians,
    path: str | Path,
    known: Stored = NOTHING,
) -> NDArray[np.int64] | None:
    """Write one primitive of points, and what is recorded as `extras`.

    `known` is what is recorded. Rotations are written with length 1.

    Returns:
        The rows in the order of the file; None if it is theirs, or recorded.

    Raises:
        ValueError: if the file would have 4 GiB or more, or the names of brushes are too long.
        SceneError: if the file cannot be written.
    """
    order = brush_order(gaussians)
    rows = gaussians if order is None else gaussians.take(order)
    stored = known.sorted_by(rows, order)
    notes = notes_of(stored)
    model = GlbWriter()
    model.uses(EXTENSION)
    model.add("meshes", primitives=[_primitive(model, rows)])
    model.add("nodes", mesh=0, name=SCENE_NODE, rotation=notes["turn"])
    model.add("scenes", nodes=[0])
    model.top |= {"scene": 0, "extras": {NOTES: notes}}
    with replacing(path) as temporary, temporary.open("wb") as file:
        model.write(file)
    return order if stored.order is None else None


def _columns(rows: Gaussians) -> Iterator[tuple[str, NDArray[Any]]]:
    """Name and numbers of each attribute, [n] or [n, width]."""
    yield "POSITION", rows.means
    yield f"{EXTENSION}:ROTATION", unit_quats(rows.quats)[:, [1, 2, 3, 0]]
    yield f"{EXTENSION}:SCALE", finite_scales(rows.scales)
    yield f"{EXTENSION}:OPACITY", rows.opacities
    for degree in range(rows.sh_degree + 1):
        for index in range(2 * degree + 1):
            yield f"{EXTENSION}:SH_DEGREE_{degree}_COEF_{index}", rows.sh[:, degree**2 + index]


def _primitive(model: GlbWriter, rows: Gaussians) -> dict[str, Any]:
    """The points, with an accessor for each attribute; the standard asks for the bounds of positions."""
    attributes = {
        name: model.accessor(column.astype(np.float32), "vertices", has_bounds=name == "POSITION")
        for name, column in _columns(rows)
    }
    own = {
        "kernel": "ellipse",
        "colorSpace": "srgb_rec709_display",
        "projection": "perspective",
        "sortingMethod": "cameraDistance",
    }
    return {"mode": POINTS, "attributes": attributes, "extensions": {EXTENSION: own}}
