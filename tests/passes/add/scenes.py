"""Bodies of Gaussians whose lines are known, and cameras around them."""

import numpy as np

import brushgs as bg
from brushgs.values.quats import quats_of
from tests.passes.scenes import gaussians_at, grid, on_sphere

SIDE = 1.0  # of the cube


def cameras(turns=((0, 0), (-12, 0), (12, 0), (45, 0), (90, 0), (180, 0), (270, 0), (315, 0), (180, -60))):
    """Cameras around the origin, each so many degrees to the right of and above the first."""
    found = []
    for right, higher in turns:
        azimuth, elevation = np.radians(30 + right), np.radians(25 + higher)
        eye = 3.2 * np.array(
            [np.cos(elevation) * np.sin(azimuth), -np.sin(elevation), -np.cos(elevation) * np.cos(azimuth)]
        )
        found.append(bg.Camera.look_at(eye, (0, 0, 0), width=400, height=300))
    return found


def flat(points, normals, size, colors):
    """Flat, nearly opaque Gaussians on a surface."""
    across = np.cross(normals, np.eye(3)[np.argmin(np.abs(normals), axis=1)])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    quats = quats_of(np.stack([across, np.cross(normals, across), normals], axis=2))
    sizes = size * np.array([1, 1, 0.05])
    return gaussians_at(points, sizes, colors, opacity=0.97, quats=quats, dtype=np.float32)


def cube(num=36):
    """A cube around the origin, each face of one tone."""
    count = num * num
    face = grid(num, 0.5 * SIDE * (1 - 1 / num), 0.5 * SIDE)
    points = [sign * np.roll(face, axis, axis=1) for axis in (1, 2, 3) for sign in (1, -1)]
    normals = [np.roll([0, 0, sign], axis) for axis in (1, 2, 3) for sign in (1, -1)]
    tones = np.repeat(0.1 + 0.16 * np.arange(6), count)[:, None]
    return flat(np.concatenate(points), np.repeat(normals, count, axis=0), 0.5 * SIDE / num, tones)


def cube_edges():
    """[12, 2, 3] ends of the edges of the cube."""
    corners = SIDE / 2 * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return np.array(
        [(a, b) for i, a in enumerate(corners) for b in corners[i:] if np.isclose(np.abs(a - b).sum(), SIDE)]
    )


def sphere(num=6000, radius=0.7):
    """A sphere around the origin, of one tone."""
    normals = on_sphere(num)
    return flat(radius * normals, normals, 1.3 * radius * np.sqrt(np.pi / num), 0.55)


def noisy_plane(num=320):
    """A plane that fills the first view, as gravel does: each Gaussian has its own tone."""
    axes = cameras()[0].viewmat[:3, :3]
    tones = np.random.default_rng(0).uniform(0.25, 0.75, (num * num, 1))
    return flat(grid(num, 3.0) @ axes, np.tile(-axes[2], (num * num, 1)), 0.7 * 6 / num, tones)
