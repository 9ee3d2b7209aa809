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


def test_two_turns_are_their_product_and_a_turn_is_orthogonal() -> None:
    first, second = Rotation.random(2, rng=np.random.default_rng(0)).as_matrix()
    found = sh_rotation(second, 3) @ sh_rotation(first, 3)
    np.testing.assert_allclose(found, sh_rotation(second @ first, 3), atol=1e-12)
    np.testing.assert_allclose(found @ found.T, np.eye(16), atol=1e-12)
    np.testing.assert_allclose(sh_rotation(np.eye(3), 3), np.eye(16), atol=1e-12)
