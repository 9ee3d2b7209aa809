"""Quaternions w, x, y, z <-> rotation matrices.

q and -q are the same rotation; quaternions may have any length above zero and are normalized here.
"""

import numpy as np

from brushgs.values.arrays import F64, Array


def normalized(quats: Array) -> F64:
    """Quaternions [N, 4] of any length above zero, scaled to length 1, float64."""
    return np.ascontiguousarray(_unit_columns(quats).T)


def rotation_matrices(quats: Array) -> F64:
    """[N, 3, 3] rotation matrices of quaternions [N, 4]: columns are the rotated axes."""
    w, x, y, z = _unit_columns(quats)
    R = np.empty((len(quats), 3, 3))
    R[:, 0, 0], R[:, 0, 1], R[:, 0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
    R[:, 1, 0], R[:, 1, 1], R[:, 1, 2] = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
    R[:, 2, 0], R[:, 2, 1], R[:, 2, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
    return R


def shortest_axes(quats: Array, scales: Array) -> F64:
    """[N, 3] unit vectors along the shortest axis of Gaussians, the normal of flat ones; of either sign."""
    return rotation_matrices(quats)[np.arange(len(quats)), :, scales.argmin(axis=1)]


def _unit_columns(quats: Array) -> F64:
    """[4, N] w, x, y, z of quaternions [N, 4], scaled to length 1: NumPy is slow along short rows."""
    columns = np.array(quats.T, dtype=np.float64, order="C")
    columns /= np.abs(columns).max(axis=0)  # first, so that no square overflows
    columns /= np.linalg.norm(columns, axis=0)
    return columns


def quats_of(rotations: F64) -> F64:
    """[N, 4] unit quaternions of rotation matrices [N, 3, 3].

    Each of four formulas divides by one component; for precision, the largest is used.
    Source: Shepperd 1978, Quaternion from rotation matrix.
    """
    products = turn_forms(rotations, 1.0)  # 4 q q^T: every row is a multiple of q
    largest = np.einsum("nii->ni", products).argmax(axis=1)
    quats = products[np.arange(len(rotations)), largest]
    return np.asarray(quats / np.linalg.norm(quats, axis=1, keepdims=True))


def turn_forms(matrices: F64, plus: float = 0.0) -> F64:
    """[N, 4, 4] symmetric forms F of matrices M [N, 3, 3]: q F q is the trace of R(q)^T M for unit q.

    With M = sum of y x^T, the q that maximises q F q is the rotation that best maps points x to y. `plus` is
    added to the diagonal; for a rotation matrix M, F + 1 is 4 q q^T.
    Source: Horn 1987, Closed-form solution of absolute orientation using unit quaternions.
    """
    M = matrices
    xx, yy, zz = M[:, 0, 0], M[:, 1, 1], M[:, 2, 2]
    wx, wy, wz = M[:, 2, 1] - M[:, 1, 2], M[:, 0, 2] - M[:, 2, 0], M[:, 1, 0] - M[:, 0, 1]
    xy, xz, yz = M[:, 0, 1] + M[:, 1, 0], M[:, 0, 2] + M[:, 2, 0], M[:, 1, 2] + M[:, 2, 1]
    rows = [
        [plus + xx + yy + zz, wx, wy, wz],
        [wx, plus + xx - yy - zz, xy, xz],
        [wy, xy, plus - xx + yy - zz, yz],
        [wz, xz, yz, plus - xx - yy + zz],
    ]
    return np.ascontiguousarray(np.array(rows).transpose(2, 0, 1))


def twists(quats: Array, axes: Array) -> F64:
    """[n] twist angles of rotations [n, 4] about unit axes [n, 3], radians, -pi to pi (swing-twist
    decomposition).

    0 for a pure swing, including a swing by half a turn, where the twist is undefined.
    """
    along = np.einsum("nj,nj->n", quats[:, 1:], axes)
    return np.asarray(2 * np.arctan2(np.where(quats[:, 0] < 0, -along, along), np.abs(quats[:, 0])))


def conjugates(quats: Array) -> F64:
    """[n, 4] inverses of unit quaternions [n, 4]."""
    return np.asarray(quats * (1.0, -1.0, -1.0, -1.0))


def quat_products(first: Array, second: Array) -> F64:
    """[N, 4] Hamilton products: the rotation `second`, then `first`. Lengths multiply."""
    a, b, c, d = np.moveaxis(first.astype(np.float64), -1, 0)
    w, x, y, z = np.moveaxis(second.astype(np.float64), -1, 0)
    return np.stack(
        [
            a * w - b * x - c * y - d * z,
            a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x,
            a * z + b * y - c * x + d * w,
        ],
        axis=-1,
    )
