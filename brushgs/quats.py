"""Quaternions w, x, y, z <-> rotation matrices.

q and -q are the same rotation; quaternions may have any length above zero and are normalised here.
"""

import numpy as np
from numpy.typing import NDArray

from brushgs.arrays import Array


def normalized(quats: Array) -> NDArray[np.float64]:
    """Quaternions [N, 4] of any length above zero, scaled to length 1, float64."""
    quats = quats.astype(np.float64)
    quats /= np.abs(quats).max(axis=1, keepdims=True)  # first, so that no square overflows
    return np.asarray(quats / np.linalg.norm(quats, axis=1, keepdims=True))


def rotation_matrices(quats: Array) -> NDArray[np.float64]:
    """[N, 3, 3] rotation matrices of quaternions [N, 4]: columns are the rotated axes."""
    w, x, y, z = normalized(quats).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.ascontiguousarray(np.array(rows).transpose(2, 0, 1))


def quats_of(rotations: NDArray[np.float64]) -> NDArray[np.float64]:
    """[N, 4] unit quaternions of rotation matrices [N, 3, 3].

    Each of four formulas divides by one component: the one with the largest is used, for precision.
    Source: Shepperd 1978, Quaternion from rotation matrix.
    """
    R = rotations
    xx, yy, zz = R[:, 0, 0], R[:, 1, 1], R[:, 2, 2]
    wx, wy, wz = R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]
    xy, xz, yz = R[:, 0, 1] + R[:, 1, 0], R[:, 0, 2] + R[:, 2, 0], R[:, 1, 2] + R[:, 2, 1]
    # 4 q q^T, row by row: every row is a multiple of q
    products = np.array(
        [
            [1 + xx + yy + zz, wx, wy, wz],
            [wx, 1 + xx - yy - zz, xy, xz],
            [wy, xy, 1 - xx + yy - zz, yz],
            [wz, xz, yz, 1 - xx - yy + zz],
        ]
    )
    largest = np.einsum("iin->in", products).argmax(axis=0)
    quats = products[largest, :, np.arange(len(R))]
    return np.asarray(quats / np.linalg.norm(quats, axis=1, keepdims=True))


def quat_products(first: Array, second: Array) -> NDArray[np.float64]:
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
