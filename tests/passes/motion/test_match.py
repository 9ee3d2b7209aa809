"""Gaussians are found again in another moment, in whatever order."""

from dataclasses import replace

import numpy as np

import brushgs as bg
from brushgs.passes.motion.appearance import Appearance
from brushgs.passes.motion.match import match
from brushgs.passes.motion.matter import Matter
from brushgs.passes.motion.recognize import UNRELATED, Recognizer
from tests.kit.for_each import for_each
from tests.passes.motion.scenes import blob, moved, turn
from tests.passes.scenes import rescaled
from tests.scenes import real_scene, still_life_of

SCENE = still_life_of(4000)
SCENE = replace(SCENE, sh=SCENE.sh[:, :1])
AXES = (0, 1, 0), (1, 2, 0.5), (-1, 0.2, 1)


def found(before, after):
    return match(*(Appearance.of(Matter.of(one)) for one in (before, after)), None)


def twisted(gaussians, by):
    """Turned about the up axis by so many radians a radius of height: no rigid motion, and no affine one."""
    center = np.median(gaussians.means, axis=0)
    away = gaussians.means.astype(float) - center
    radius = np.percentile(np.linalg.norm(away, axis=1), 90)
    angles = by * away[:, 1] / radius
    cos, sin = np.cos(angles), np.sin(angles)
    x, y, z = away.T
    means = np.stack([cos * x + sin * z, y, cos * z - sin * x], axis=1) + center
    return replace(gaussians, means=means.astype(np.float32))


def shuffled(gaussians, drop=0.0):
    """In another order, and the rows that they were."""
    rng = np.random.default_rng(0)
    rows = rng.permutation(len(gaussians))
    rows = rows[rng.random(len(rows)) >= drop]
    return gaussians.take(rows), rows


@for_each("degrees", [10, 55, 170])
@for_each("axis", AXES)
def test_all_rows_are_found_through_a_turn_growth_and_another_light(axis, degrees):
    after = moved(SCENE, turn(axis, np.radians(degrees)), (3, -1, 2), size=1.3)
    after, rows = shuffled(replace(after, sh=after.sh + 0.3))
    result = found(SCENE, after)
    assert min(result.share, (result.was == rows).mean()) > 0.99
    moves = after.means - SCENE.means[rows]
    size = np.percentile(np.linalg.norm(SCENE.means, axis=1), 50)
    assert np.median(np.linalg.norm(result.steps - moves, axis=1)) < 1e-4 * size


@for_each("name", ["koala.ply", "guitar.ksplat"])
def test_real_scenes_are_found_through_a_turn_and_a_twist(name):
    scene = bg.load(real_scene(name))
    scene = scene.take(np.random.default_rng(0).permutation(len(scene))[:12_000])
    after, rows = shuffled(moved(twisted(scene, 0.2), turn((1, 2, 0.5), np.radians(40)), (0, 0, 0)))
    result = found(scene, after)
    assert min(result.share, (result.was == rows).mean()) > 0.95


def test_what_a_moment_lacks_is_not_found_and_the_others_are():
    after, rows = shuffled(moved(SCENE, turn((0, 1, 0), 0.5), (1, 0, 0)), drop=0.3)
    result = found(after, SCENE)
    is_there = np.isin(np.arange(len(SCENE)), rows)
    assert result.is_same[is_there].mean() > 0.98
    assert result.is_same[~is_there].mean() < 0.3
    assert (rows[result.was] == np.arange(len(SCENE)))[is_there].mean() > 0.98


@for_each("factor", [1e-12, 1e12])
def test_the_unit_does_not_matter(factor):
    before = rescaled(SCENE, factor)
    after, rows = shuffled(moved(before, turn((0, 1, 0), 0.6), np.array([2, 0, 0]) * factor))
    assert (found(before, after).was == rows).mean() > 0.99


CLOUD = blob(500)
DEGENERATE = {
    **{f"{count} rows": blob(count) for count in (1, 2, 7)},
    "in one place": replace(CLOUD, means=np.zeros((500, 3))),
    "in a line": replace(CLOUD, means=CLOUD.means * (0, 0, 1)),
    "points unseen": replace(CLOUD, scales=np.zeros((500, 3)), opacities=np.zeros(500)),
    "strays": replace(CLOUD, means=np.where(np.arange(500)[:, None] < 5, 1e7, CLOUD.means)),
}


@for_each("name", DEGENERATE)
def test_few_and_degenerate_gaussians_are_sound(name):
    scene = DEGENERATE[name]
    result = found(scene, moved(scene, turn((0, 0, 1), 0), (0.1, 0, 0)))
    assert ((result.was >= 0) & (result.was < len(scene))).all()
    for values in (result.places, result.steps, found(scene, SCENE).places, found(SCENE, scene).places):
        assert np.isfinite(values).all()


def test_other_things_are_not_found():
    rng, other = np.random.default_rng(1), blob(3000, 3, spread=2.0)
    other = replace(other, scales=other.scales * rng.lognormal(0, 1.5, other.scales.shape))
    assert found(SCENE, other).share < UNRELATED


def test_what_one_moment_misses_is_remembered():
    recognizer = Recognizer(Matter.of(SCENE))
    fewer, kept = shuffled(moved(SCENE, turn((0, 1, 0), 0.2), (0, 0, 0)), drop=0.2)
    first = recognizer.step(Matter.of(fewer), 1 / 24)
    assert (first.was == kept).mean() > 0.98
    assert 0.1 < len(first.missed) / len(SCENE) < 0.3
    known = np.concatenate([kept, first.missed])
    second = recognizer.step(Matter.of(moved(SCENE, turn((0, 1, 0), 0.4), (0, 0, 0))), 1 / 24)
    assert (known[second.was] == np.arange(len(SCENE))).mean() > 0.98
    assert second.share > 0.98
    third = recognizer.step(Matter.of(fewer), 1.0)  # too late
    assert len(third.missed) == 0
