"""Gaussians moved by the matrix of a node of a 3D file, and what a model of ours records (.glb, USD).

The numbers of the file are those of the scene, whose up is any axis. Programs take +y for up: so the node is
turned, and the turn is recorded. A reader that finds the node turned so takes the numbers as they are; and
cameras that were placed around that node come back to the scene by its name, see `gltf_file.SCENE_NODE`.
"""

from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from brushgs.formats.scenes.columns import Columns
from brushgs.formats.scenes.stored import Stored, content_of, parse_content, read_stored
from brushgs.values.quats import quats_of, rotation_matrices
from brushgs.values.sh import sh_rotation

_TOLERANCE = 1e-6  # of matrices written with float32
_LARGEST_SCALE = 1e38  # of float32; also false for NaN


class Placement:
    """An affine map of Gaussians.

    Args:
        matrix: [4, 4], world from mesh.
    """

    def __init__(self, matrix: NDArray[np.float64]) -> None:
        self._linear, self._offset = matrix[:3, :3], matrix[:3, 3]
        self._is_identity = np.array_equal(matrix, np.eye(4))
        # Turn and stretch apart (polar decomposition); the turn mirrors where the determinant is negative.
        left, self._stretch, right = np.linalg.svd(self._linear)
        self._turn = left @ right
        self._scale = float(self._stretch[0])
        self._is_uniform = bool(np.ptp(self._stretch) <= _TOLERANCE * self._scale)

    def apply(self, rows: Columns, num_terms: int) -> None:
        """Move some rows in place.

        Args:
            rows: in the standard layout, with log-scales.
            num_terms: spherical-harmonic terms in use.
        """
        if self._is_identity:
            return
        rows.means[:] = rows.means.astype(np.float64) @ self._linear.T + self._offset
        if self._is_uniform:
            rows.scales += np.float32(np.log(self._scale)) if self._scale else np.float32(-np.inf)
            if not np.allclose(self._turn, np.eye(3), atol=1e-12):
                # A mirrored ellipsoid is the one turned by the opposite matrix.
                proper = self._turn * np.sign(np.linalg.det(self._turn))
                rows.quats[:] = _product(quats_of(proper[None])[0], rows.quats)
        else:
            self._stretch_ellipsoids(rows)
        if num_terms > 1:
            rotation = sh_rotation(self._turn, int(np.sqrt(num_terms)) - 1)
            rows.sh[:, 1:num_terms] = np.einsum("ij,njc->nic", rotation[1:, 1:], rows.sh[:, 1:num_terms])

    def _stretch_ellipsoids(self, rows: Columns) -> None:
        """New axes and scales: the left singular vectors and the singular values of the mapped axes.

        Rows with values that cannot be drawn stay as they are, to be found later.
        """
        is_sound = np.isfinite(rows.quats).all(axis=1) & rows.quats.any(axis=1)
        scales = np.exp(rows.scales.astype(np.float64))
        is_sound &= (scales < _LARGEST_SCALE).all(axis=1)
        axes = rotation_matrices(rows.quats[is_sound]) * scales[is_sound, None, :]
        left, values, _ = np.linalg.svd(self._linear @ axes)
        left[:, :, 2] *= np.sign(np.linalg.det(left))[:, None]
        rows.quats[is_sound] = quats_of(left)
        rows.scales[is_sound] = np.log(values)


def _product(first: NDArray[np.float64], quats: NDArray[np.float32]) -> NDArray[np.float64]:
    """Quaternions w x y z of rotations `quats` [N, 4] followed by the rotation `first` [4]."""
    w, x, y, z = first
    matrix = np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])
    return np.asarray(quats.astype(np.float64) @ matrix.T)


NOTES = "brushgs"  # the key in the `extras` of a .glb and the `customData` of a prim
_TURN = "turn"  # quaternion x, y, z, w
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
