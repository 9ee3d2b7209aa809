"""Strokes are carried where rows do not correspond."""

import weakref
from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.passes.motion.frames import carried, follow_frames
from brushgs.passes.motion.rows import FADE
from brushgs.passes.reduce.cluster import group
from brushgs.rendering.motion import AT_REST, OPACITY, SHIFT, TURN
from tests.passes.motion.scenes import blob, joined, moved, turn
from tests.passes.scenes import assert_same
from tests.scenes import real_scene

RATE = 30
TIMES = np.arange(RATE + 1) / RATE
STILL = turn((1, 0, 0), 0)
BODY = blob(600)
FAR = blob(600, 1, at=(8, 0, 0))


def shuffled(at, *, drop=0.03, duration=1.0):
    """A clip whose rows are in another order in each moment, and some of them missing."""

    def sample(time):
        rng = np.random.default_rng(round(time * RATE))
        gaussians = at(time)
        rows = rng.permutation(len(gaussians))
        return gaussians.take(rows[rng.random(len(rows)) >= drop])

    return bg.MovingScene(duration, False, sample)


def of_first(scene, num_strokes, time=0.0):
    """Strokes of the first moment, their members and labels."""
    members = scene.at(time)
    members = replace(members, ids=np.arange(len(members), dtype=np.int32))
    grouping = group(members, num_strokes)
    strokes = grouping.merged("cover")
    return replace(strokes, ids=np.arange(len(strokes), dtype=np.int32)), members, grouping.labels


def followed(at, num_strokes=20, *, times=TIMES, drop=0.03, target=None):
    """How many strokes there were at first, all strokes, their motion, and its whole table."""
    scene = shuffled(at, drop=drop)
    first, members, labels = of_first(scene, num_strokes)
    strokes, motion, _ = follow_frames(scene, times, first, members, labels, target=target)
    assert np.isfinite(motion.table).all()
    table = np.tile(np.array(AT_REST), (len(times), len(strokes), 1))
    table[:, np.searchsorted(strokes.ids, motion.ids)] = motion.table
    return len(first), strokes, motion, table


def sizes(strokes):
    return np.sort(strokes.scales, axis=1)[:, 1]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_strokes_of_a_rigid_body_follow_it(dtype):
    body = BODY.astype(dtype)

    def at(time):
        return moved(body, turn((0, 0, 1), 2 * time), (3 * time, 0, 0))

    num, strokes, motion, table = followed(at)
    assert len(strokes) == num
    assert strokes.means.dtype == dtype
    for position in (10, 20, 30):
        time = TIMES[position]
        actual = motion.pose(position).moved(strokes)
        expected = moved(strokes, turn((0, 0, 1), 2 * time), (3 * time, 0, 0))
        away = np.linalg.norm(actual.means - expected.means, axis=1) / sizes(strokes)
        assert away.max() < 0.1  # it has moved by 10 sizes
        turned = np.abs(table[position, :, TURN] @ turn((0, 0, 1), 2 * time))
        assert np.degrees(2 * np.arccos(np.minimum(turned, 1))).max() < 3


def test_what_rests_does_not_tremble_where_rows_are_missing():
    num, strokes, _, table = followed(lambda _: BODY)
    assert len(strokes) == num
    steps = np.linalg.norm(np.diff(table[..., SHIFT], axis=0), axis=2) / sizes(strokes)
    assert steps.max() < 0.02
    assert np.abs(table[..., OPACITY] - 1).max() < 0.1


def test_strokes_are_born_where_paint_is_missing():
    num, strokes, _, table = followed(lambda time: joined(BODY, FAR) if time > 0.5 else BODY)
    born = slice(num, None)
    assert 8 <= len(strokes) - num <= 30  # as many Gaussians each as the twenty of the body
    assert (strokes.means[born, 0] > 5).sum() >= len(strokes) - num - 1  # but for a stray of the body
    np.testing.assert_array_equal(strokes.ids, np.arange(len(strokes)))
    np.testing.assert_array_equal(table[TIMES < 0.5 - FADE, born, OPACITY], 0)
    # They paint all of it: together about as much as it does.
    assert table[-5:, born, OPACITY].mean() > 0.9
    assert np.abs(table[:, :num, SHIFT]).max() < 0.1


def test_strokes_die_with_what_they_painted_and_the_others_live():
    num, strokes, _, table = followed(lambda time: joined(BODY, FAR) if time < 0.5 else BODY, 40)
    is_gone = strokes.means[:, 0] > 4
    assert len(strokes) == num
    np.testing.assert_array_equal(table[TIMES > 0.55 + FADE][:, is_gone, OPACITY], 0)
    assert np.median(table[-1, ~is_gone, OPACITY]) == 1
    assert table[:, ~is_gone, OPACITY].min() > 0


def test_what_teleports_is_found_again_and_keeps_its_strokes():
    def at(time):
        return joined(moved(BODY, STILL, (0, 20, 0)) if time > 0.5 else BODY, FAR)

    num, strokes, _, table = followed(at, 40)
    goes = strokes.means[:, 0] < 4
    assert len(strokes) == num
    away = np.linalg.norm(table[-1, goes, SHIFT] - (0, 20, 0), axis=1) / sizes(strokes)[goes]
    assert np.median(away) < 0.1
    assert np.abs(table[:, ~goes, SHIFT]).max() < 1  # what rests does not go with it
    assert table[-1, :, OPACITY].min() > 0.5


def test_what_another_thing_takes_the_place_of_gets_other_strokes():
    """Nothing of the first is like the second: strokes die and are born, and none flies over."""
    rng, other = np.random.default_rng(2), blob(600, 1)
    scales = other.scales * rng.lognormal(0, 2, other.scales.shape)
    other = replace(other, sh=rng.normal(0, 1, other.sh.shape), scales=scales)
    num, strokes, _, table = followed(lambda time: other if time > 0.5 else BODY, 20, target=20)
    after = TIMES > 0.5 + FADE
    np.testing.assert_array_equal(table[after, :num, OPACITY], 0)
    shown = (table[after] > 0)[..., OPACITY].sum(axis=1)
    assert abs(shown - 20).max() <= 2
    assert len(strokes) - num < 30


@pytest.mark.parametrize("gap", [1, 8])
def test_strokes_outlive_moments_without_anything(gap):
    def at(time):
        return BODY.take(slice(0)) if 12 <= round(time * RATE) < 12 + gap else BODY

    num, strokes, _, table = followed(at)
    assert len(strokes) == num
    assert table[-1, :, OPACITY].min() > 0.8
    assert np.linalg.norm(table[..., SHIFT], axis=2).max() < 0.1
    lowest = table[12 + gap // 2, :, OPACITY].max()
    assert lowest > 0.8 if gap == 1 else lowest == pytest.approx(1 - 4 / RATE / FADE, abs=0.1)


def test_one_moment_rests_and_two_move_and_the_first_strokes_stay_as_they_were():
    _, _, motion, _ = followed(lambda _: BODY, times=TIMES[:1])
    assert motion.table.shape == (1, 0, 12)
    scene = shuffled(lambda time: moved(BODY, STILL, (9 * time, 0, 0)), drop=0)
    first, members, labels = of_first(scene, 20)
    strokes, motion, _ = follow_frames(scene, TIMES[:2], first, members, labels)
    np.testing.assert_allclose(np.median(motion.table[1, :, SHIFT], axis=0), (0.3, 0, 0), atol=0.02)
    assert_same(strokes, first)
    np.testing.assert_array_equal(strokes.ids, first.ids)


def test_a_clip_that_starts_with_nothing_has_strokes_later():
    empty = replace(BODY.take(slice(0)), ids=np.zeros(0, np.int32))
    scene = shuffled(lambda time: BODY if time > 0.2 else empty)
    strokes, motion, _ = follow_frames(scene, TIMES, empty, empty, np.zeros(0, np.int64))
    assert len(strokes) > 0
    assert motion.table[-1, :, OPACITY].mean() > 0.9


def test_what_is_missing_is_said():
    scene = shuffled(lambda _: BODY)
    first, *rest = of_first(scene, 20)
    with pytest.raises(ValueError, match="at least one moment, got none"):
        follow_frames(scene, TIMES[:0], first, *rest)
    with pytest.raises(ValueError, match="must have ids"):
        follow_frames(scene, TIMES, replace(first, ids=None), *rest)


def test_ten_times_as_many_gaussians_at_every_other_moment_are_the_same_strokes():
    few = BODY.take(slice(0, 60))
    num, strokes, _, table = followed(lambda time: few if round(time * RATE) % 2 else BODY, drop=0)
    assert len(strokes) == num
    assert (table[..., OPACITY] > 0).all()
    assert np.median(np.linalg.norm(table[-1, :, SHIFT], axis=1) / sizes(strokes)) < 0.3


def test_two_things_that_pass_each_other_keep_their_strokes():
    """One is black and moves through the other, which is white and rests."""
    white, black = replace(BODY, sh=0 * BODY.sh + 1), replace(blob(600, 1), sh=0 * BODY.sh - 1)

    def at(time):
        return joined(white, moved(black, STILL, (3 * time - 4, 0, 0)))

    num, strokes, _, table = followed(at, 60)
    rests, moves = strokes.sh[:num, 0, 0] > 0.9, strokes.sh[:num, 0, 0] < -0.9
    assert min(rests.sum(), moves.sum()) > 5
    for rows, way in ((rests, (0, 0, 0)), (moves, (3, 0, 0))):
        away = np.linalg.norm(table[-1, :num][rows, SHIFT] - way, axis=1) / sizes(strokes)[:num][rows]
        assert np.median(away) < 0.5  # of 10 sizes that one of them has moved


def test_at_most_three_moments_are_in_memory():
    alive, most, count = weakref.WeakSet(), [], []
    inner = shuffled(lambda time: moved(BODY, STILL, (time, 0, 0)))

    def sample(time):
        gaussians = inner.sample(time)
        alive.add(gaussians)
        most.append(len(alive))
        return gaussians

    scene = bg.MovingScene(1.0, False, sample)
    follow_frames(scene, TIMES[:10], *of_first(inner, 20), advance=lambda: count.append(1))
    assert max(most) <= 3
    assert len(count) == 10


def test_hardly_any_opacity_changes_its_stroke_in_a_real_scene():
    """Five samples of a quarter of a trained clip, in another order each, and 3 % of the rows missing."""
    whole = bg.load_moving(real_scene("moving/cook_spinach.splatv"))
    clip = bg.MovingScene(whole.duration, False, lambda time: whole.at(time).take(slice(None, None, 4)))
    rows_at = {}
    times = np.linspace(0, clip.duration, 30)[:5]

    def sample(time):
        at = int(np.argmin(np.abs(times - time)))
        rng = np.random.default_rng(at)
        gaussians = clip.at(time)
        rows = np.flatnonzero((gaussians.opacities > 1 / 255) & (rng.random(len(gaussians)) >= 0.03))
        rng.shuffle(rows)
        rows_at[at] = rows
        return replace(gaussians.take(rows), ids=np.arange(len(rows), dtype=np.int32))

    scene = bg.MovingScene(times[-1], False, sample, times=times)
    members = bg.prune(scene.at(0))
    grouping = group(members, 500)
    last, shares, nums = None, [], []
    for moment in carried(scene, times, members.ids, grouping.labels, np.ones(grouping.num_clusters, bool)):
        labels = np.full(len(clip.at(0)), -2)
        labels[rows_at[moment.at]] = moment.labels
        opacities = np.zeros(len(labels))
        opacities[rows_at[moment.at]] = moment.gaussians.opacities
        if last is not None:
            both = (labels > -2) & (last > -2)
            shares.append(opacities[both & (labels != last)].sum() / opacities[both].sum())
        last = labels
        nums.append(len(moment.masses))
    assert max(shares) < 0.005  # measured: 0.1 to 0.41 %; asked for: at most 2 %
    # 0.5 % of the Gaussians are born in 1/30 of the clip; measured: 0.2 % of the strokes.
    assert np.diff(nums).mean() <= 0.005 * 500
