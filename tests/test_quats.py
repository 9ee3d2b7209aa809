import numpy as np
from scipy.spatial.transform import Rotation

from brushgs.values.quats import (
    conjugates,
    normalized,
    quat_products,
    quats_of,
    rotation_matrices,
    turn_forms,
    twists,
)
from tests.kit.for_each import for_each


def some_quats(n=200):
    return np.random.default_rng(0).normal(size=(n, 4))


def test_rotation_matrices_agree_with_scipy():
    quats = some_quats()
    expected = Rotation.from_quat(quats[:, [1, 2, 3, 0]]).as_matrix()
    np.testing.assert_allclose(rotation_matrices(quats), expected, atol=1e-14)


@for_each("length", [1e-200, 1e-30, 1e30, 1e200])
def test_length_and_sign_do_not_matter(length):
    quats = some_quats()
    np.testing.assert_allclose(rotation_matrices(-length * quats), rotation_matrices(quats), atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(normalized(quats * length), axis=1), 1, rtol=1e-14)


def test_quats_of_undoes_rotation_matrices_up_to_sign_of_half_turns_too():
    half_turns = [[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [0, 0.6, 0.8, 0], [1e-9, 0, 0.6, 0.8]]
    quats = np.concatenate([normalized(some_quats()), half_turns])
    back = quats_of(rotation_matrices(quats))
    np.testing.assert_allclose(np.abs((back * quats).sum(axis=1)), 1, rtol=1e-14)


def test_a_twist_is_what_a_rotation_turns_about_an_axis():
    g = np.random.default_rng(3)
    axes, swings = g.normal(size=(2, 200, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    swings -= (swings * axes).sum(axis=1, keepdims=True) * axes  # across the axes, at most 2 radians
    swings *= (g.uniform(0, 2, 200) / np.linalg.norm(swings, axis=1))[:, None]
    angles = g.uniform(-3.1, 3.1, 200)
    swing = Rotation.from_rotvec(swings)
    both = swing * Rotation.from_rotvec(axes * angles[:, None])
    for sign in (1, -1):
        quats = sign * both.as_quat(scalar_first=True)
        np.testing.assert_allclose(twists(quats, axes), angles, atol=1e-9)
        np.testing.assert_allclose(twists(conjugates(quats), axes), -angles, atol=1e-9)
        np.testing.assert_allclose(twists(swing.as_quat(scalar_first=True), axes), 0, atol=1e-9)


def test_a_product_turns_by_the_second_and_then_by_the_first():
    first, second = some_quats(), np.roll(some_quats(), 1, axis=0)
    products = quat_products(first, second)
    expected = rotation_matrices(first) @ rotation_matrices(second)
    np.testing.assert_allclose(rotation_matrices(products), expected, atol=1e-13)
    lengths = np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
    np.testing.assert_allclose(np.linalg.norm(products, axis=1), lengths, rtol=1e-13)
    ones = quat_products(normalized(first), conjugates(normalized(first)))
    np.testing.assert_allclose(ones, np.tile((1.0, 0, 0, 0), (200, 1)), atol=1e-15)


def test_a_form_is_how_well_a_rotation_fits_a_matrix():
    matrices = np.random.default_rng(1).normal(size=(200, 3, 3))
    quats = normalized(some_quats())
    forms = turn_forms(matrices)
    np.testing.assert_array_equal(forms, forms.transpose(0, 2, 1))
    values = np.einsum("ni,nij,nj->n", quats, forms, quats)
    traces = np.einsum("nij,nij->n", rotation_matrices(quats), matrices)
    np.testing.assert_allclose(values, traces, atol=1e-13)
