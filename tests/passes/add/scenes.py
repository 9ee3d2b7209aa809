"""Bodies of Gaussians whose lines are known, and cameras around them."""

import numpy as np

import brushgs as bg
from brushgs.values.quats import quats_of
from tests.passes.scenes import gaussians_at

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
    grid = SIDE * ((np.arange(num) + 0.5) / num - 0.5)
    u, v = (axis.ravel() for axis in np.meshgrid(grid, grid))
    points, normals, colors = [], [], []
    for face in range(6):
        axis, sign = face // 2, 1 - 2 * (face % 2)
        p, n = np.zeros((num * num, 3)), np.zeros((num * num, 3))
        p[:, axis], p[:, (axis + 1) % 3], p[:, (axis + 2) % 3] = sign * SIDE / 2, u, v
        n[:, axis] = sign
        points.append(p)
        normals.append(n)
        colors.append(np.full((num * num, 3), 0.1 + 0.16 * face))
    return flat(np.concatenate(points), np.concatenate(normals), 0.5 * SIDE / num, np.concatenate(colors))


def cube_edges():
    """[12, 2, 3] ends of the edges of the cube."""
    corners = SIDE / 2 * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return np.array(
        [(a, b) for i, a in enumerate(corners) for b in corners[i:] if np.isclose(np.abs(a - b).sum(), SIDE)]
    )


def sphere(num=6000, radius=0.7):
    """A sphere around the origin, of one tone."""
    rows = np.arange(num) + 0.5
    y, turn = 1 - 2 * rows / num, rows * np.pi * (1 + 5**0.5)
    normals = np.stack([np.sqrt(1 - y * y) * np.cos(turn), y, np.sqrt(1 - y * y) * np.sin(turn)], axis=1)
    size = 1.3 * radius * np.sqrt(4 * np.pi / num) / 2
    return flat(radius * normals, normals, size, np.full((num, 3), 0.55))


def noisy_plane(num=320, seed=0):
    """A plane that fills the first view, as gravel does: each Gaussian has its own tone."""
    camera = cameras()[0]
    u, v = (axis.ravel() for axis in np.meshgrid(*[np.linspace(-3, 3, num)] * 2))
    points = u[:, None] * camera.viewmat[0, :3] + v[:, None] * camera.viewmat[1, :3]
    tones = np.random.default_rng(seed).uniform(0.25, 0.75, num * num)
    normals = np.tile(-camera.viewmat[2, :3], (num * num, 1))
    return flat(points, normals, 0.7 * 6 / num, tones[:, None] * np.ones(3))
