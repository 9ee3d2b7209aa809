"""Small random scenes for the tests of the passes."""

import numpy as np

from brushgs.values.gaussians import Gaussians


def random_gaussians(n, seed=0, *, terms=1, spread=1.0, size=0.1, dtype=np.float64):
    rng = np.random.default_rng(seed)
    return Gaussians(
        (spread * rng.normal(size=(n, 3))).astype(dtype),
        rng.normal(size=(n, 4)).astype(dtype),
        (size * np.exp(rng.normal(size=(n, 3)))).astype(dtype),
        rng.uniform(0.05, 1, n).astype(dtype),
        rng.normal(size=(n, terms, 3)).astype(dtype),
    )


def replaced(gaussians, **columns):
    """The same Gaussians with some columns exchanged."""
    names = ("means", "quats", "scales", "opacities", "sh")
    return Gaussians(**{name: columns.get(name, getattr(gaussians, name)) for name in names})


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
