"""Boards of two colors beside each other, and round strokes on them: which way they run is known."""

import numpy as np

from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import quats_of
from brushgs.values.sh import C0


def turned_frame(seed=3):
    """A rotation that no axis is special to."""
    return np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]


def surface(uv, colors, size, *, frame=None, aspect=1.0, angles=0.0, dtype=np.float64):
    """Discs on the plane of the first two columns of `frame`, their long axes at angles from the first."""
    frame = np.eye(3) if frame is None else frame
    angles = np.broadcast_to(angles, len(uv))
    cosines, sines, zeros = np.cos(angles), np.sin(angles), np.zeros(len(uv))
    local = np.array([[cosines, -sines, zeros], [sines, cosines, zeros], [zeros, zeros, zeros + 1]])
    rotations = frame @ local.transpose(2, 0, 1)
    rotations[:, :, 2] *= np.sign(np.linalg.det(frame))
    size = np.broadcast_to(size, len(uv))
    scales = np.stack([size * np.sqrt(aspect), size / np.sqrt(aspect), 0.05 * size], axis=1)
    return Gaussians(
        (uv @ frame[:, :2].T).astype(dtype),
        quats_of(rotations).astype(dtype),
        scales.astype(dtype),
        np.full(len(uv), 0.9, dtype),
        ((colors - 0.5) / C0)[:, None].astype(dtype),
    )


def boards(uv, width=0.25):
    """Colors of boards that run along u, light and dark by turns, [N, 3]."""
    is_dark = np.floor(uv[:, 1] / width) % 2 == 1
    return np.where(is_dark[:, None], (0.3, 0.2, 0.1), (0.8, 0.7, 0.5))


def planks(num=4000, num_strokes=300, seed=0, *, frame=None, color=boards, **kwargs):
    """Gaussians of a floor of boards, and strokes with an aspect of 1.05 in random directions."""
    random = np.random.default_rng(seed)
    uv, places = random.uniform(-1, 1, (num, 2)), random.uniform(-0.9, 0.9, (num_strokes, 2))
    gaussians = surface(uv, color(uv), 0.03, frame=frame, **kwargs)
    angles = random.uniform(0, np.pi, num_strokes)
    strokes = surface(places, color(places), 0.1, frame=frame, aspect=1.05, angles=angles, **kwargs)
    return strokes, gaussians


def long_axes(strokes):
    """[n, 3] longest axes, unit vectors, as the columns of the rotation matrices have them."""
    from brushgs.values.quats import rotation_matrices

    columns = np.argmax(strokes.scales, axis=1)
    return rotation_matrices(strokes.quats)[np.arange(len(strokes)), :, columns]


def aspects(strokes):
    """[n] of the longest axis to the middle one."""
    scales = np.sort(strokes.scales, axis=1)
    return scales[:, 2] / scales[:, 1]
