"""Spherical harmonics turn with the Gaussian that they belong to."""

import numpy as np
from scipy.spatial.transform import Rotation

from brushgs.values.sh import sh_basis, sh_rotation
from tests.kit.for_each import for_each


@for_each("degree", range(4))
@for_each("mirror", [1, -1])
def test_a_turned_gaussian_shows_the_color_of_the_direction_before(degree: int, mirror: int) -> None:
    rng = np.random.default_rng([degree, mirror + 1])
    coefficients = rng.normal(size=((degree + 1) ** 2, 3))
    directions = rng.normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for turn in Rotation.random(20, rng=rng).as_matrix() * mirror:
        turned = sh_rotation(turn, degree) @ coefficients
        seen = sh_basis(directions @ turn.T, degree) @ turned
        np.testing.assert_allclose(seen, sh_basis(directions, degree) @ coefficients, atol=1e-12)
