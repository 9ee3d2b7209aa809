"""Clips of the same Gaussians in any order get rows that correspond; else their motion is estimated."""

import pickle
from dataclasses import replace

import numpy as np

from brushgs.passes.motion.estimate import EstimatedMotion
from brushgs.passes.motion.found_again import found_again
from brushgs.values.moving import MovingScene
from tests.kit.for_each import for_each
from tests.passes.motion.scenes import blob, joined, moved, turn

TIMES = np.arange(6) / 24
BODY, GROUND = blob(900, 1), blob(600, 2, at=(7, 0, 0))


def whole(time):
    """The ground rests; the body turns by 30 degrees a moment, and goes."""
    return joined(moved(BODY, turn((0, 1, 0.4), np.radians(30) * 24 * time), (12 * time, 0, 0)), GROUND)


class Shuffled:
    """Moments of a clip in another order each, some of them without some of the rows."""

    def __init__(self, at=whole, drop=0, uneven=False):
        self.whole, self.drop, self.uneven = at, drop, uneven

    def rows(self, time):
        moment = int(np.abs(TIMES - time).argmin())
        gaussians = self.whole(TIMES[moment])
        rows = np.random.default_rng(moment).permutation(len(gaussians))
        return rows[: len(rows) - self.drop - (moment if self.uneven else 0)]

    def __call__(self, time):
        return self.whole(TIMES[int(np.abs(TIMES - time).argmin())]).take(self.rows(time))


def clip(sample):
    return MovingScene(TIMES[-1] + 1 / 24, False, sample, times=TIMES)


def test_rows_are_found_and_those_that_rest_are_known():
    sample, count = Shuffled(), []
    found = found_again(clip(sample), TIMES, lambda: count.append(1))
    scene = found.scene
    assert scene is not None
    assert scene.has_rows
    assert (scene.duration, len(count)) == (clip(sample).duration, len(TIMES))
    assert found.shares.min() > 0.99
    order = sample.rows(0)
    for time in TIMES:
        np.testing.assert_array_equal(scene.at(time).means, whole(time).means[order])
    np.testing.assert_array_equal(scene.resting, order >= len(BODY))
    np.testing.assert_array_equal(scene.at(TIMES[-1]).means, scene.at(9.0).means)
    copy = pickle.loads(pickle.dumps(scene))  # scenes cross processes
    np.testing.assert_array_equal(copy.at(0.1).means, scene.at(0.1).means)
    middle = scene.at(1.5 / 24).means
    np.testing.assert_allclose(middle, (scene.at(1 / 24).means + scene.at(2 / 24).means) / 2, atol=1e-6)


def all_alike(time):
    """Nothing tells one Gaussian from another but its place."""
    gaussians = whole(time)
    return replace(gaussians, scales=0 * gaussians.scales + 0.1, sh=0 * gaussians.sh)


@for_each(
    ("sample", "why"),
    [
        (Shuffled(uneven=True), "moments hold 1,500 and 1,499 Gaussians"),
        (Shuffled(drop=60), "of a moment are not found in the next"),
        (Shuffled(all_alike, drop=30), "of a moment are "),
        (Shuffled(lambda time: blob(1500, int(24 * time + 0.5))), "of a moment are found in the next"),
        (lambda time: BODY.take(slice(0)), "holds no Gaussians"),
    ],
)
def test_rows_that_are_others_are_not_taken_for_the_same(sample, why):
    found = found_again(clip(sample), TIMES)
    assert found.scene is None
    assert why in found.why


@for_each("sample", [Shuffled(), Shuffled(drop=60, uneven=True)])
def test_where_they_were_earlier_is_estimated(sample):
    motion = EstimatedMotion(clip(sample), TIMES)
    for now, then in ((TIMES[3], TIMES[2]), (TIMES[5], TIMES[0]), (TIMES[4], TIMES[4])):
        rows = sample.rows(now)
        np.testing.assert_array_equal(motion.at(now).means, sample(now).means)
        away = np.linalg.norm(motion.means_at(then, now) - whole(then).means[rows], axis=1)
        assert (away < 0.05).mean() > 0.8  # of five steps each lacks others, 4 %
    between = motion.at(2.5 / 24).means
    expected = (whole(2 / 24).means + whole(3 / 24).means)[sample.rows(2 / 24)] / 2
    assert (np.linalg.norm(between - expected, axis=1) < 0.05).mean() > 0.9


def test_moments_without_anything_are_no_motion():
    def sample(time):
        return BODY.take(slice(0)) if abs(time - TIMES[2]) < 0.01 else BODY

    motion = EstimatedMotion(clip(sample), TIMES)
    assert len(motion.means_at(TIMES[1], TIMES[2])) == 0
    np.testing.assert_array_equal(motion.means_at(TIMES[1], TIMES[4]), BODY.means)
