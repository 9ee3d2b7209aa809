"""Small random scenes for the tests of the passes."""

import numpy as np

from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0


def random_gaussians(n, seed=0, *, terms=1, spread=1.0, size=0.1, dtype=np.float64):
    rng = np.random.default_rng(seed)
    return Gaussians(
        (spread * rng.normal(size=(n, 3))).astype(dtype),
        rng.normal(size=(n, 4)).astype(dtype),
        (size * np.exp(rng.normal(size=(n, 3)))).astype(dtype),
        rng.uniform(0.05, 1, n).astype(dtype),
        rng.normal(size=(n, terms, 3)).astype(dtype),
    )


def gaussians_at(means, scales, rgb=0.5, *, opacity=0.9, quats=(1, 0, 0, 0), dtype=np.float64):
    """Gaussians at places; each other column is one for all or one a row, `rgb` display-encoded."""
    means = np.asarray(means, dtype)

    def column(values, *width):
        return np.broadcast_to(np.asarray(values, np.float64), (len(means), *width)).astype(dtype)

    sh = ((column(rgb, 3) - 0.5) / C0).astype(dtype)[:, None]
    return Gaussians(means, column(quats, 4), column(scales, 3), column(opacity), sh)


def grid(num, reach=1.0, z=0.0):
    """[num^2, 3] places on a square across z."""
    x, y = (axis.ravel() for axis in np.meshgrid(*2 * [np.linspace(-reach, reach, num)]))
    return np.stack([x, y, np.full(num * num, z)], axis=1)


def on_sphere(num):
    """[num, 3] places all over a sphere of radius 1, y from -1 to 1."""
    steps = np.arange(num) + 0.5
    y, turn = 1 - 2 * steps / num, steps * np.pi * (3 - 5**0.5)
    return np.stack([np.sqrt(1 - y * y) * np.cos(turn), y, np.sqrt(1 - y * y) * np.sin(turn)], axis=1)


def rescaled(gaussians, unit):
    """The same scene in another unit, in its dtype."""
    unit = gaussians.means.dtype.type(unit)
    return replaced(gaussians, means=gaussians.means * unit, scales=gaussians.scales * unit)


def replaced(gaussians, **columns):
    """The same Gaussians with some columns exchanged."""
    names = ("means", "quats", "scales", "opacities", "sh")
    return Gaussians(**{name: columns.get(name, getattr(gaussians, name)) for name in names})


def strange_strokes():
    """Strokes that have no plane, no size, no distance from each other, or far too much of it."""
    scene = random_gaussians(60, size=0.1)
    rows = np.arange(60)
    one = np.ones((60, 3))
    needles = scene.scales * [1e7, 1, 1]
    line = np.stack([rows * 0.1, 0 * rows, 0 * rows], axis=1)
    return {
        "none": scene.take(slice(0)),
        "one": scene.take(slice(1)),
        "two": scene.take(slice(2)),
        "equal places": replaced(scene, means=0 * scene.means + 5),
        "needles": replaced(scene, scales=needles),
        "discs": replaced(scene, scales=scene.scales * [1, 1, 0]),
        "lines": replaced(scene, scales=scene.scales * [1, 0, 0]),
        "points": replaced(scene, scales=0 * scene.scales),
        "balls": replaced(scene, scales=0.1 * one),
        "a row": replaced(scene, means=line),
        "a plane": replaced(scene, means=scene.means * [1, 1, 0], sh=0 * scene.sh),
        "immense": replaced(scene, scales=scene.scales * 1e30),
        "loud": replaced(scene, sh=100 * scene.sh),
        "black": replaced(scene, sh=np.full_like(scene.sh, -9)),
        "opaque": replaced(scene, opacities=np.ones(60)),
        "transparent": replaced(scene, opacities=0 * scene.opacities),
        "tiny": replaced(scene, means=scene.means * 1e-4, scales=scene.scales * 1e-4),
        "huge": replaced(scene, means=scene.means * 1e4, scales=scene.scales * 1e4),
        "the smallest": replaced(scene, means=scene.means * 1e-37, scales=scene.scales * 1e-37),
        "the largest": replaced(scene, means=scene.means * 1e36, scales=scene.scales * 1e36),
        "an outlier": replaced(scene, means=scene.means + 1e30 * (rows[:, None] == 7)),
    }


def colors_of(gaussians):
    """[N, 3] view-independent colors, beyond the display range too."""
    return 0.5 + C0 * gaussians.sh[:, 0].astype(np.float64)


def with_colors(gaussians, rgb):
    """The same Gaussians in these base colors, their other terms kept."""
    sh = gaussians.sh.copy()
    sh[:, 0] = (rgb - 0.5) / C0
    return replaced(gaussians, sh=sh)


def columns_of(gaussians):
    return gaussians.means, gaussians.quats, gaussians.scales, gaussians.opacities, gaussians.sh


def assert_same(actual, expected):
    for a, b in zip(columns_of(actual), columns_of(expected), strict=True):
        np.testing.assert_array_equal(a, b)


def covariances(gaussians):
    """The plain definition, [N, 3, 3]: R diag(scales^2) R^T with R by scipy."""
    from scipy.spatial.transform import Rotation

    R = Rotation.from_quat(gaussians.quats[:, [1, 2, 3, 0]]).as_matrix()
    return R @ (gaussians.scales[:, :, None] ** 2 * R.transpose(0, 2, 1))
