"""Gaussians moved by the matrix of a node of a 3D file, and what a model of ours records (.glb, USD).

The numbers of the file are those of the scene, whose up is any axis. Programs take +y for up: so the node is
turned, and the turn is recorded. A reader that finds the node turned so takes the numbers as they are; and
cameras that were placed around that node come back to the scene by its name, see `gltf_file.SCENE_NODE`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np

from brushgs.formats.scenes.columns import Columns, Encoding
from brushgs.formats.scenes.rows import Decoder, RowSource, decoder_of_parts
from brushgs.formats.scenes.stored import Stored, content_of, parse_content, read_stored
from brushgs.values.arrays import F64
from brushgs.values.quats import quat_products, quats_of, rotation_matrices
from brushgs.values.sh import sh_rotation

_TOLERANCE = 1e-6  # of matrices written with float32
_LARGEST_SCALE = 1e38  # of float32; also false for NaN
_BLOCK_ROWS = 1 << 13


@dataclass(frozen=True)
class Part:
    """Gaussians that one node of a model places."""

    num_rows: int
    num_terms: int  # spherical-harmonic terms of each
    open: Callable[[], Decoder]  # what that gives reads raw values, and no other terms
    encoding: Encoding  # of these values
    matrix: F64  # [4, 4], world from node

    def decoder(self) -> Decoder:
        """Decodes rows to the standard layout, placed in the world."""
        read, placement = self.open(), Placement(self.matrix)

        def decode(start: int, stop: int, out: Columns) -> None:
            read(start, stop, out)
            out.sh[:, self.num_terms :] = 0
            out.standardize(self.encoding)
            placement.apply(out, self.num_terms)

        return decode


def rows_of_parts(parts: Sequence[Part], *, is_whole: bool) -> RowSource:
    """The rows of all parts, at least one, in order; `is_whole` is as in `RowSource`."""
    open_decoder = decoder_of_parts([(part.num_rows, part.decoder) for part in parts])
    num_rows, num_terms = sum(part.num_rows for part in parts), max(part.num_terms for part in parts)
    return RowSource(num_rows, num_terms, open_decoder, _BLOCK_ROWS, is_logit=True, is_whole=is_whole)


class Placement:
    """An affine map of Gaussians by a matrix [4, 4], world from mesh."""

    def __init__(self, matrix: F64) -> None:
        self._linear, self._offset = matrix[:3, :3], matrix[:3, 3]
        self._is_identity = np.array_equal(matrix, np.eye(4))
        # Turn and stretch apart (polar decomposition); the turn mirrors where the determinant is negative.
        left, self._stretch, right = np.linalg.svd(self._linear)
        self._turn = left @ right
        self._scale = float(self._stretch[0])
        self._is_uniform = bool(np.ptp(self._stretch) <= _TOLERANCE * self._scale)

    def apply(self, rows: Columns, num_terms: int) -> None:
        """Move some rows of the standard layout, with log-scales and so many harmonic terms, in place."""
        if self._is_identity:
            return
        rows.means[:] = rows.means.astype(np.float64) @ self._linear.T + self._offset
        if self._is_uniform:
            rows.scales += np.float32(np.log(self._scale)) if self._scale else np.float32(-np.inf)
            if not np.allclose(self._turn, np.eye(3), atol=1e-12):
                # A mirrored ellipsoid is the one turned by the opposite matrix.
                proper = self._turn * np.sign(np.linalg.det(self._turn))
                rows.quats[:] = quat_products(quats_of(proper[None]), rows.quats)
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


NOTES = "brushgs"  # the key in the `extras` of a .glb and the `customData` of a prim
_TURN = "turn"  # quaternion x, y, z, w
_Share = Annotated[float, msgspec.Meta(ge=-1, le=1)]


def notes_of(stored: Stored) -> dict[str, Any]:
    """The object that is recorded. Its "turn" is the rotation of the node, x, y, z, w."""
    up = None if stored.first_view is None else stored.first_view.up
    return content_of(stored) | {_TURN: [0.0, 0.0, 0.0, 1.0] if up is None else _turn_to_y(up)}


def read_notes(path: Path, notes: object, matrices: Sequence[F64]) -> tuple[Stored, bool]:
    """What a model records, and whether its node stands as we wrote it, whose turn is then to be taken back.

    Args:
        path: the file, for a warning where notes are damaged.
        notes: the object that is recorded, or anything else in files of others.
        matrices: [4, 4] of the nodes that have something.
    """
    turn = notes.get(_TURN) if isinstance(notes, dict) else None
    try:
        x, y, z, w = msgspec.convert(turn, tuple[_Share, _Share, _Share, _Share])
    except msgspec.ValidationError:
        return Stored(), False
    if not any((x, y, z, w)):
        return Stored(), False
    stored = read_stored(path, lambda: parse_content(notes))
    expected = np.eye(4)
    expected[:3, :3] = rotation_matrices(np.array([[w, x, y, z]]))[0]
    if len(matrices) == 1 and np.allclose(matrices[0], expected, rtol=0, atol=_TOLERANCE):
        return stored, True
    # Something else was added, or it was moved.
    return stored._replace(first_view=None, counts=None, brushes=()), False


def _turn_to_y(up: F64) -> list[float]:
    """The shortest rotation that takes a unit vector to +y; half a turn about x from -y."""
    x, y, z = (float(value) for value in up)
    if y < -1 + 1e-12:
        return [1.0, 0.0, 0.0, 0.0]
    quat = np.array([-z, 0.0, x, 1 + y])  # up cross y, and 1 + up . y
    return [float(value) for value in quat / np.linalg.norm(quat)]
