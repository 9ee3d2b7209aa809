"""Gaussians moved by the matrix of a node: turned, scaled, stretched, mirrored."""

import numpy as np
from numpy.typing import NDArray

from brushgs.formats.scenes.columns import Columns
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
