"""Scenes that the tests of the first view make."""

from functools import cache
from itertools import permutations, product

import numpy as np

import brushgs as bg
from brushgs.first_view import find_first_view
from brushgs.values.camera import FirstView
from brushgs.values.quats import quats_of, rotation_matrices
from brushgs.values.sh import C0

ROTATIONS = [
    np.eye(3)[list(order)] * np.array(signs)[:, None]
    for order in permutations(range(3))
    for signs in product((1.0, -1.0), repeat=3)
    if np.linalg.det(np.eye(3)[list(order)] * np.array(signs)[:, None]) > 0
]


def gaussians(means, normals, sizes, colors, opacities=0.95, flatness=0.1) -> bg.Gaussians:
    """Flat Gaussians on surfaces: [n, 3] centers and normals, sizes in the surface, colors 0 to 1."""
    count = len(means)
    z = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    x = np.cross(z, np.eye(3)[np.abs(z).argmin(axis=1)])
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    scales = np.broadcast_to(sizes, count)[:, None] * np.array([1.0, 1.0, flatness])
    quats = quats_of(np.stack([x, np.cross(z, x), z], axis=2))
    sh = (np.broadcast_to(colors, (count, 3)) - 0.5) / C0
    columns = (means, quats, scales, np.broadcast_to(opacities, count), sh[:, None])
    return bg.Gaussians(*(np.ascontiguousarray(column, np.float32) for column in columns))


def joined(*scenes: bg.Gaussians) -> bg.Gaussians:
    """One scene of several."""
    return bg.Gaussians.joined(scenes)


def moved(scene: bg.Gaussians, *, rotation=None, scale=1.0, offset=(0.0, 0.0, 0.0)) -> bg.Gaussians:
    """The scene rotated, then scaled, then shifted."""
    rotation = np.eye(3) if rotation is None else rotation
    means = scale * scene.means.astype(np.float64) @ rotation.T + offset
    columns = means, quats_of(rotation @ rotation_matrices(scene.quats)), scale * scene.scales.astype(float)
    columns = (np.ascontiguousarray(column, scene.means.dtype) for column in columns)
    return bg.Gaussians(*columns, scene.opacities, scene.sh)


def about(axis, degrees: float):
    """[3, 3] rotation about an axis [3]."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(degrees)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


@cache
def statue(seed: int = 0) -> bg.Gaussians:
    """A head on a round plinth, up -y, with a face towards -z (azimuth 0).

    As in trained scenes what faces down is coarse and plain, and the back is plainer than the face.
    """
    rng = np.random.default_rng(seed)
    parts = []
    for count, low, size in ((9000, -0.3, 0.022), (500, -1.0, 0.12)):  # the upper side, and the coarse lower
        normals = rng.normal(size=(4 * count, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        up = -normals[:, 1]
        is_kept = up > low if low > -1 else up < -0.3
        normals = normals[is_kept][:count]
        radii = np.array([0.5, 0.7, 0.6])
        means = normals * radii + (0, -0.9, 0)
        normals = normals / radii
        colors = np.full((len(means), 3), (0.7, 0.55, 0.45))
        is_face = normals[:, 2] < -0.8
        x, y = means[:, 0], means[:, 1] + 0.9
        eyes = is_face & ((np.abs(x) - 0.2) ** 2 + (y + 0.15) ** 2 < 0.008)
        mouth = is_face & (np.abs(x) < 0.2) & (np.abs(y - 0.25) < 0.05)
        brows = is_face & (np.abs(np.abs(x) - 0.2) < 0.12) & (np.abs(y + 0.32) < 0.03)
        colors[eyes], colors[mouth], colors[brows] = (0.1, 0.2, 0.7), (0.8, 0.1, 0.1), (0.1, 0.05, 0.0)
        colors = np.clip(colors + rng.normal(0, 0.03, colors.shape), 0, 1)
        parts.append(gaussians(means, normals, size * np.where(is_face, 0.6, 1.2), colors))
    angle, radius = rng.uniform(0, 2 * np.pi, 3500), 0.9 * np.sqrt(rng.uniform(0, 1, 3500))
    top = np.stack([radius * np.cos(angle), np.full(3500, -0.2), radius * np.sin(angle)], axis=1)
    parts.append(gaussians(top, np.tile([0.0, -1, 0], (3500, 1)), 0.03, _speckled(rng, 3500)))
    angle, height = rng.uniform(0, 2 * np.pi, 3000), rng.uniform(-0.2, 0.1, 3000)
    out = np.stack([np.cos(angle), np.zeros(3000), np.sin(angle)], axis=1)
    parts.append(gaussians(0.9 * out + height[:, None] * [0, 1, 0], out, 0.03, _speckled(rng, 3000)))
    angle, radius = rng.uniform(0, 2 * np.pi, 120), 0.9 * np.sqrt(rng.uniform(0, 1, 120))
    under = np.stack([radius * np.cos(angle), np.full(120, 0.1), radius * np.sin(angle)], axis=1)
    parts.append(gaussians(under, np.tile([0.0, 1, 0], (120, 1)), 0.15, (0.4, 0.4, 0.4)))
    return joined(*parts)


@cache
def statue_view() -> FirstView:
    """The first view of the statue, all of it estimated."""
    return find_first_view(statue())


def _speckled(rng, count):
    """[count, 3] the colors of granite."""
    return np.repeat(np.clip(rng.normal(0.5, 0.15, (count, 1)), 0, 1), 3, axis=1)


@cache
def on_a_plaza() -> bg.Gaussians:
    """The statue on a plaza that is ten times as wide, with things around."""
    rng = np.random.default_rng(1)
    places = rng.uniform(-12, 12, (9000, 3))
    places[:, 1] = 0.1
    ground = gaussians(places, np.tile([0.0, -1, 0], (9000, 1)), 0.15, _speckled(rng, 9000))
    angle, height = rng.uniform(0, 2 * np.pi, 6000), rng.uniform(-3, 0.1, 6000)
    out = np.stack([np.cos(angle), np.zeros(6000), np.sin(angle)], axis=1)
    wall = gaussians(12 * out + height[:, None] * [0, 1, 0], -out, 0.15, _speckled(rng, 6000))
    return joined(statue(), ground, wall)


@cache
def relief() -> bg.Gaussians:
    """A wall of colored stones all across the view from the origin along +z with y down."""
    rng = np.random.default_rng(2)
    x, y = np.meshgrid(np.linspace(-4, 4, 160), np.linspace(-3, 3, 120))
    means = np.stack([x.ravel(), y.ravel(), 4 + 0.3 * np.sin(3 * x.ravel()) * np.cos(2 * y.ravel())], axis=1)
    stones = rng.uniform(0, 1, (40, 40, 3))
    colors = stones[((y.ravel() + 3) * 6).astype(int) % 40, ((x.ravel() + 4) * 6).astype(int) % 40]
    return gaussians(means, np.tile([0.0, 0, -1], (len(means), 1)), 0.05, colors)
