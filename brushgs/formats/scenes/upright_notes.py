"""What a model of ours for 3D programs (.glb, USD) records, and how its node turns the scene upright.

The numbers of the file are those of the scene, whose up is any axis. Programs take +y for up: so the node is
turned, and the turn is recorded. A reader that finds the node turned so takes the numbers as they are; and
cameras that were placed around that node come back to the scene by its name, see `scene_node.py`.
"""

from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from brushgs.formats.scenes.stored import Stored, content_of, parse_content, read_stored
from brushgs.values.quats import rotation_matrices

NOTES = "brushgs"  # the key in the `extras` of a .glb and the `customData` of a prim
_TURN = "turn"  # quaternion x, y, z, w
_TOLERANCE = 1e-6  # of a matrix that went through float32
_Part = Annotated[float, msgspec.Meta(ge=-1, le=1)]


def notes_of(stored: Stored) -> dict[str, Any]:
    """The object that is recorded. Its "turn" is the rotation of the node, x, y, z, w."""
    up = None if stored.first_view is None else stored.first_view.up
    return content_of(stored) | {_TURN: [0.0, 0.0, 0.0, 1.0] if up is None else _turn_to_y(up)}


def read_notes(path: Path, notes: object) -> tuple[Stored, NDArray[np.float64] | None]:
    """What a model records, and the matrix [3, 3] that its node was turned by; None in files of others.

    Args:
        path: the file, for a warning where notes are damaged.
        notes: the object that is recorded, or anything else in files of others.
    """
    if not isinstance(notes, dict):
        return Stored(), None
    try:
        x, y, z, w = msgspec.convert(notes.get(_TURN), tuple[_Part, _Part, _Part, _Part])
    except msgspec.ValidationError:
        return Stored(), None
    if not any((x, y, z, w)):
        return Stored(), None
    matrix = rotation_matrices(np.array([[w, x, y, z]]))[0]
    return read_stored(path, lambda: parse_content(notes)), matrix


def is_turned_by(matrix: NDArray[np.float64], turn: NDArray[np.float64]) -> bool:
    """Whether a node [4, 4] does nothing but this turn [3, 3]."""
    expected = np.eye(4)
    expected[:3, :3] = turn
    return bool(np.allclose(matrix, expected, rtol=0, atol=_TOLERANCE))


def _turn_to_y(up: NDArray[np.float64]) -> list[float]:
    """The shortest rotation that takes a unit vector to +y; half a turn about x from -y."""
    x, y, z = (float(value) for value in up)
    if y < -1 + 1e-12:
        return [1.0, 0.0, 0.0, 0.0]
    quat = np.array([-z, 0.0, x, 1 + y])  # up cross y, and 1 + up . y
    return [float(value) for value in quat / np.linalg.norm(quat)]
