"""Strokes follow their members."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.passes.motion.canonical import canonical
from brushgs.passes.motion.rows import FADE, follow_rows
from brushgs.passes.reduce.merge import merge_clusters
from tests.kit.for_each import for_each
from tests.passes.motion.scenes import blob, clip, joined, moved, turn
from tests.passes.scenes import covariances

TIMES = np.linspace(0, 1, 11)


def followed(scene, labels, times=TIMES):
    """Strokes of the members with these labels, and their motion."""
    members = canonical(scene, times).gaussians
    labels = np.asarray(labels)[members.ids]
    strokes = replace(merge_clusters(members, labels), ids=np.unique(labels).astype(np.int32))
    return strokes, follow_rows(scene, times, strokes, members, labels)


@for_each("dtype", [np.float32, np.float64])
@for_each("num", [1, 2, 40])
def test_strokes_of_a_rigid_body_follow_it(dtype, num):
    body = blob(num, dtype=dtype)

    def at(time):
        return moved(body, turn((1, 2, 3), 2.5 * time), (time, 0, -3 * time**2), size=1 + time)

    strokes, motion = followed(clip(at), np.arange(num) % 4)
    for position, time in enumerate(TIMES):
        expected = moved(strokes, turn((1, 2, 3), 2.5 * time), (time, 0, -3 * time**2), size=1 + time)
        found = motion.pose(position).moved(strokes)
        np.testing.assert_allclose(found.means, expected.means, atol=1e-5)
        np.testing.assert_allclose(covariances(found), covariances(expected), atol=1e-5)


def test_what_teleports_is_there_at_once_and_nothing_else_moves():
    rests, jumps = blob(10), blob(10, 1, (5, 0, 0))
    far = np.array([1e7, 0, 0])
    scene = clip(lambda time: joined(rests, moved(jumps, turn((1, 0, 0), 0), far * (time > 0.45))))
    strokes, motion = followed(scene, np.repeat([0, 1], 10))
    np.testing.assert_array_equal(motion.ids, [1])
    np.testing.assert_allclose(motion.pose(4).moved(strokes).means, strokes.means)
    after = motion.pose(5).moved(strokes)
    np.testing.assert_allclose(after.means, strokes.means + far * [[0], [1]], rtol=1e-6)
    assert np.isfinite(motion.table).all()


def test_strokes_whose_members_rest_are_not_in_the_motion():
    rests, moves = blob(10), blob(10, 1, (5, 0, 0))

    def at(time):
        return joined(rests, moved(moves, turn((1, 0, 0), 0), (0, time, 0)))

    for resting in (None, np.repeat([True, False], 10)):
        _, motion = followed(clip(at, resting=resting), np.repeat([4, 7, 2, 9], 5))
        np.testing.assert_array_equal(motion.ids, [2, 9])


def test_opacity_follows_that_of_members_and_waits_for_the_fade():
    body = blob(8)
    times = np.arange(31) / 30

    def at(time):  # shrinks to a half, and is gone at once
        factor = np.clip(1 - time, 0.5, 1) if time < 0.61 else 0.0
        return replace(moved(body, turn((1, 0, 0), 0), (time, 0, 0)), opacities=body.opacities * factor)

    strokes, motion = followed(clip(at), np.arange(8), times)
    poses = [motion.pose(position).moved(strokes) for position in range(31)]
    np.testing.assert_allclose(poses[6].opacities, 0.8 * strokes.opacities, rtol=1e-5)
    gone = np.flatnonzero(times >= 0.61)
    assert (np.diff([pose.opacities for pose in poses], axis=0) > -1 / 30 / FADE - 1e-5).all()
    np.testing.assert_array_equal(poses[-1].opacities, 0)
    for position in gone:  # where it was last
        np.testing.assert_allclose(poses[position].means, poses[gone[0] - 1].means, atol=1e-6)


def test_what_comes_later_waits_where_it_will_be():
    early, late = blob(5), blob(5, 1)

    def at(time):
        late_now = moved(late, turn((1, 0, 0), 0), (time, 0, 0))
        return joined(early, replace(late_now, opacities=late.opacities * (time > 0.55)))

    strokes, motion = followed(clip(at), np.repeat([0, 1], 5))
    np.testing.assert_array_equal(motion.ids, [1])
    np.testing.assert_array_equal(motion.pose(0).moved(strokes).opacities, strokes.opacities * [1, 0])
    np.testing.assert_allclose(motion.table[0, 0, :3], motion.table[6, 0, :3], atol=1e-6)


def test_degenerate_members_give_finite_motions():
    """Points in one place, unseen ones, and some far away."""
    body = joined(blob(4), blob(4), blob(4, 1, (1e7, 0, 0)), blob(4, 2))
    labels, is_point = np.repeat(np.arange(4), 4), np.repeat([0, 1, 1, 1], 4)[:, None]
    body = replace(body, means=body.means * is_point, scales=body.scales * is_point)
    body = replace(body, opacities=body.opacities * np.repeat([1, 0, 1, 1], 4))
    for dtype in (np.float32, np.float64):
        scene = clip(lambda t, dtype=dtype: moved(body.astype(dtype), turn((0, 0, 1), 1e-3 * t), (t, 0, 0)))
        members = replace(scene.at(0), ids=np.arange(16, dtype=np.int32))
        strokes = replace(merge_clusters(members, labels), ids=np.arange(4, dtype=np.int32))
        motion = follow_rows(scene, TIMES, strokes, members, labels)
        assert np.isfinite(motion.table).all()
        away = motion.pose(10).moved(strokes).means - moved(strokes, turn((0, 0, 1), 1e-3), (1, 0, 0)).means
        assert np.abs(away[[0, 3]]).max() < 1e-5
        assert np.abs(away[2]).max() < 2.1  # float32 has steps of 1 there
    with pytest.raises(ValueError, match="rows must correspond"):
        follow_rows(replace(scene, has_rows=False), TIMES, strokes, members, labels)


def test_blocks_of_strokes_give_the_same_bits(monkeypatch):
    from brushgs.passes.motion import rows

    body, rng = blob(200), np.random.default_rng(0)
    speeds, lives = rng.normal(size=(200, 3)), rng.uniform(size=200)

    def at(time):
        return replace(body, means=body.means + time * speeds, opacities=body.opacities * (time <= lives))

    _, whole = followed(clip(at), np.arange(200) % 30)
    monkeypatch.setattr(rows, "MEMBERS_AT_A_TIME", 16)
    monkeypatch.setattr(rows, "NUMBERS_AT_A_TIME", 500)
    _, parts = followed(clip(at), np.arange(200) % 30)
    for name in ("table", "pivots", "ids"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(parts, name))
