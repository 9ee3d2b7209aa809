"""The rotation and the growth of bodies."""

import numpy as np
from scipy.spatial.transform import Rotation

from brushgs.passes.motion.rows import rigid_motions
from brushgs.values.quats import conjugates, quat_products

ONE = np.array([[1.0, 0, 0, 0]])


def quats_from(rotations):
    return np.atleast_2d(rotations.as_quat(scalar_first=True))


def motion_of(before, after, turns=ONE, *, balls=(1e-9, 1e-9), since=np.inf):
    """The quaternion and the growth of one body of equal members."""
    num = len(before)
    quats, growths = rigid_motions(
        np.full(num, 1 / num),
        np.array([0, num]),
        before - before.mean(axis=0),
        after - after.mean(axis=0),
        (np.full(num, balls[0]), np.full(num, balls[1])),
        np.broadcast_to(turns, (num, 4)),
        ONE,
        since,
    )
    return quats[0], growths[0]


def angle(one, other):
    """Degrees between two rotations."""
    product = quat_products(np.atleast_2d(one), conjugates(np.atleast_2d(other)))[0]
    return np.degrees(2 * np.arctan2(np.linalg.norm(product[1:]), np.abs(product[0])))


def test_it_is_the_rotation_of_procrustes_where_members_are_points():
    g = np.random.default_rng(0)
    before = g.normal(size=(12, 3))
    noisy = Rotation.from_rotvec((0.3, 1.4, -0.8)).apply(2 * before) + 0.2 * g.normal(size=(12, 3))
    expected, _ = Rotation.align_vectors(noisy - noisy.mean(axis=0), before - before.mean(axis=0))
    quat, growth = motion_of(before, noisy)
    assert angle(quat, quats_from(expected)) < 1e-3
    assert abs(growth - 2) < 0.1


def test_members_in_one_place_turn_as_the_mean_of_their_own_rotations():
    g = np.random.default_rng(0)
    rotations = Rotation.from_rotvec((0.5, 0, 1)) * Rotation.from_rotvec(0.3 * g.normal(size=(8, 3)))
    signs = np.where(np.arange(8) % 2, 1, -1)[:, None]
    quat, growth = motion_of(np.zeros((8, 3)), np.zeros((8, 3)), signs * quats_from(rotations), balls=(1, 4))
    assert angle(quat, quats_from(rotations.mean())) < 1e-3
    np.testing.assert_allclose(growth, 2)


def test_the_rotation_before_counts_where_members_do_not_move_as_one():
    g = np.random.default_rng(0)
    before, after = g.normal(size=(2, 4, 3))
    alone, _ = motion_of(before, after)
    soon, _ = motion_of(before, after, since=1 / 30)
    late, _ = motion_of(before, after, since=2.0)
    assert angle(alone, ONE) > 20
    assert angle(soon, ONE) < 0.3 * angle(alone, ONE)
    assert angle(late, alone) < 1
    turn = Rotation.from_rotvec((0, 2, 1))
    rigid, _ = motion_of(before, turn.apply(before), quats_from(turn), since=1 / 30)
    assert angle(rigid, quats_from(turn)) < 1e-3
