"""Gaussians placed by the node of a 3D file, and the notes of exported models (.glb, USD).

The numbers of an exported file are in scene coordinates, where any axis may be up. 3D programs take +y as up,
so the node is rotated and its rotation is recorded. If our reader finds the node with the recorded rotation,
it ignores it. Cameras placed around the node are mapped back to the scene by the name of the node, see
`gltf_file.SCENE_NODE`.
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

_TOLERANCE = 1e-6  # for matrices written with float32
_LARGEST_SCALE = 1e38  # within float32; the comparison is false for NaN too
_BLOCK_ROWS = 1 << 13


@dataclass(frozen=True)
class Part:
    """Gaussians placed by one node of a model."""

    num_rows: int
    num_terms: int  # spherical-harmonic terms of each Gaussian
    open: Callable[[], Decoder]  # opens a decoder of raw values, with the first `num_terms` terms
    encoding: Encoding  # of the raw values
    matrix: F64  # [4, 4], world from node

    def decoder(self) -> Decoder:
        """A decoder of rows in the standard layout, placed in the world."""
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
    """An affine transform of Gaussians by a matrix [4, 4], world from mesh."""

    def __init__(self, matrix: F64) -> None:
        self._linear, self._offset = matrix[:3, :3], matrix[:3, 3]
        self._is_identity = np.array_equal(matrix, np.eye(4))
        # Polar decomposition into rotation and stretch; with a negative determinant the rotation mirrors.
        left, self._stretch, right = np.linalg.svd(self._linear)
        self._turn = left @ right
        self._scale = float(self._stretch[0])
        self._is_uniform = bool(np.ptp(self._stretch) <= _TOLERANCE * self._scale)

    def apply(self, rows: Columns, num_terms: int) -> None:
        """Transform rows of the standard layout (log-scales) with `num_terms` harmonic terms, in place."""
        if self._is_identity:
            return
        rows.means[:] = rows.means.astype(np.float64) @ self._linear.T + self._offset
        if self._is_uniform:
            rows.scales += np.float32(np.log(self._scale)) if self._scale else np.float32(-np.inf)
            if not np.allclose(self._turn, np.eye(3), atol=1e-12):
                # A mirrored ellipsoid equals the one rotated by the negated matrix.
                proper = self._turn * np.sign(np.linalg.det(self._turn))
                rows.quats[:] = quat_products(quats_of(proper[None]), rows.quats)
        else:
            self._stretch_ellipsoids(rows)
        if num_terms > 1:
            rotation = sh_rotation(self._turn, int(np.sqrt(num_terms)) - 1)
            rows.sh[:, 1:num_terms] = np.einsum("ij,njc->nic", rotation[1:, 1:], rows.sh[:, 1:num_terms])

    def _stretch_ellipsoids(self, rows: Columns) -> None:
        """Set axes and scales to the left singular vectors and the singular values of the transformed axes.

        Undrawable rows are unchanged; they are dropped later.
        """
        is_sound = np.isfinite(rows.quats).all(axis=1) & rows.quats.any(axis=1)
        scales = np.exp(rows.scales.astype(np.float64))
        is_sound &= (scales < _LARGEST_SCALE).all(axis=1)
        axes = rotation_matrices(rows.quats[is_sound]) * scales[is_sound, None, :]
        left, values, _ = np.linalg.svd(self._linear @ axes)
        left[:, :, 2] *= np.sign(np.linalg.det(left))[:, None]
        rows.quats[is_sound] = quats_of(left)
        rows.scales[is_sound] = np.log(values)


NOTES = "brushgs"  # key in the `extras` of a .glb and the `customData` of a prim
_TURN = "turn"  # quaternion x, y, z, w
_Share = Annotated[float, msgspec.Meta(ge=-1, le=1)]


def notes_of(stored: Stored) -> dict[str, Any]:
    """The JSON object to record. Its "turn" is the rotation of the node, x, y, z, w."""
    up = None if stored.first_view is None else stored.first_view.up
    return content_of(stored) | {_TURN: [0.0, 0.0, 0.0, 1.0] if up is None else _turn_to_y(up)}


def read_notes(path: Path, notes: object, matrices: Sequence[F64]) -> tuple[Stored, bool]:
    """The notes of a model, and whether its node has the rotation that we wrote, which must then be ignored.

    Args:
        path: the file, for a warning about damaged notes.
        notes: the recorded object; may be anything in files of other programs.
        matrices: [4, 4] of the nodes with content.
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
    # The node was moved, or another one was added.
    return stored._replace(first_view=None, counts=None, brushes=()), False


def _turn_to_y(up: F64) -> list[float]:
    """The shortest rotation from a unit vector to +y, as x, y, z, w; from -y half a turn about x."""
    x, y, z = (float(value) for value in up)
    if y < -1 + 1e-12:
        return [1.0, 0.0, 0.0, 0.0]
    quat = np.array([-z, 0.0, x, 1 + y])  # cross product of up and +y, and 1 + their dot product
    return [float(value) for value in quat / np.linalg.norm(quat)]
