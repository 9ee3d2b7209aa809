"""What projecting and rasterising mean: plain NumPy in float64, written to be read, not to be fast.

The compiled core is held to these functions by the tests; nothing else calls them.
"""

import numpy as np
from numpy.typing import NDArray

from brushgs.scene import Boxes, Camera, Gaussians
from brushgs.sh import sh_basis

CLAMP = 1.3  # the Jacobian is taken at most this factor outside the field of view, as scenes are trained
LEAST_ALPHA = 1 / 255  # fragments with less are skipped
DIRECTION_NOISE = 1e-14  # directions are known to this; below, an ellipse is round and an angle is vertical


def project(gaussians: Gaussians, camera: Camera, *, num_sigmas: float = 2.0, low_pass: float = 0.3) -> Boxes:
    """`brushgs.project`, in float64 whatever the dtype of the scene."""
    scene = gaussians.astype(np.float64)
    W = camera.viewmat[:3, :3]
    t = scene.means @ W.T + camera.viewmat[:3, 3]
    ids = np.flatnonzero((t[:, 2] > camera.near) & (scene.opacities >= LEAST_ALPHA)).astype(np.int32)
    scene, t = scene.take(ids), t[ids]

    M = (
        _jacobian(t, camera) @ W @ rotation_matrices(scene.quats) * scene.scales[:, None, :]
    )  # J W R S, [M, 2, 3]
    angles = _major_axis(M)
    u = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    v = np.stack([-u[:, 1], u[:, 0]], axis=1)
    deviations = [np.sqrt(((w[:, None, :] @ M) ** 2).sum(axis=(1, 2)) + low_pass) for w in (u, v)]
    half_extents = num_sigmas * np.stack(deviations, axis=1)
    centers = t[:, :2] / t[:, 2:] * np.diag(camera.K)[:2] + camera.K[:2, 2]

    reach = np.abs(u) * half_extents[:, :1] + np.abs(v) * half_extents[:, 1:]
    is_outside = (centers + reach <= 0) | (centers - reach >= (camera.width, camera.height))
    is_empty = (half_extents <= 0).any(axis=1)
    directions = scene.means - camera.position
    directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    shades = np.einsum("nk,nkc->nc", sh_basis(directions, scene.sh_degree), scene.sh)
    colors = np.maximum(0, 0.5 + shades)

    kept = np.flatnonzero(~is_outside.any(axis=1) & ~is_empty)
    kept = kept[np.argsort(t[kept, 2], kind="stable")]
    columns = (centers, half_extents, angles, t[:, 2], colors, scene.opacities, ids)
    return Boxes(*(column[kept] for column in columns))


def rotation_matrices(quats: NDArray[np.float64]) -> NDArray[np.float64]:
    """[N, 3, 3] rotations of quaternions [N, 4] w, x, y, z of any length above zero."""
    quats = quats / np.abs(quats).max(axis=1, keepdims=True)  # squares of any length stay in range
    w, x, y, z = (quats / np.linalg.norm(quats, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def _jacobian(t: NDArray[np.float64], camera: Camera) -> NDArray[np.float64]:
    """[M, 2, 3] derivative of the pixel by camera coordinates t, at most a little outside the view."""
    fx, fy = camera.K[0, 0], camera.K[1, 1]
    limit_x, limit_y = CLAMP * camera.width / (2 * fx), CLAMP * camera.height / (2 * fy)
    z = t[:, 2]
    ratio_x = np.clip(t[:, 0] / z, -limit_x, limit_x)
    ratio_y = np.clip(t[:, 1] / z, -limit_y, limit_y)
    zero = np.zeros_like(z)
    rows = [[fx / z, zero, -fx * ratio_x / z], [zero, fy / z, -fy * ratio_y / z]]
    return np.moveaxis(np.array(rows), 2, 0)


def _major_axis(M: NDArray[np.float64]) -> NDArray[np.float64]:
    """[M] angle of the longer axis of M M^T in (-pi/2, pi/2], 0 where it is round."""
    x, y = M[:, 0], M[:, 1]
    difference = ((x - y) * (x + y)).sum(axis=1)  # a - c of the covariance (a, b; b, c)
    twice_b = 2 * (x * y).sum(axis=1)
    is_round = np.hypot(difference, twice_b) <= DIRECTION_NOISE * (M**2).sum(axis=(1, 2))
    angles = np.where(is_round, 0.0, 0.5 * np.arctan2(twice_b, difference))
    return np.where(angles <= -np.pi / 2 + DIRECTION_NOISE, np.pi / 2, angles)
