"""The subject, its surroundings, heights above the ground and connected parts."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.first_view import find_first_view
from brushgs.options.where import Where
from brushgs.passes.where import WhereContext, memberships
from brushgs.passes.where.ground import Ground
from brushgs.passes.where.parts import connected_parts
from brushgs.values.camera import FirstView
from brushgs.values.quats import rotation_matrices
from tests.kit.for_each import for_each
from tests.kit.regions import owners
from tests.passes.motion.scenes import moved, turn
from tests.passes.scenes import gaussians_at, on_sphere, rescaled
from tests.scenes import still_life_of

WALL, TABLE, JUG, ORANGES = 0, 1, range(3, 5), range(7, 11)
COUNT = 50_000


@pytest.fixture(scope="module")
def seen():
    """The still life and its first view."""
    return still_life_of(COUNT), find_first_view(still_life_of(COUNT))


def of(text, scene, view, soft=0.0):
    return memberships(Where.parse(text), scene, WhereContext(view, soft))


def balls(*centers, num=800, radius=1.0):
    """Balls of Gaussians that touch each other inside of each ball."""
    points = np.concatenate([radius * on_sphere(num) + center for center in np.array(centers, float)])
    return gaussians_at(points, 2.0 * radius / np.sqrt(num), opacity=0.8, dtype=np.float32)


def around(gaussians, up=(0.0, -1.0, 0.0)):
    return FirstView(gaussians.means.astype(float), np.array(up), 0.0, 0.0)


def test_the_subject_of_the_still_life_stands_on_the_table_before_the_wall(seen):
    owner, subject = owners(COUNT), of("subject", *seen) == 1
    assert subject[np.isin(owner, JUG)].mean() > 0.9
    assert subject[np.isin(owner, ORANGES)].mean() > 0.95
    assert subject[owner == WALL].mean() == 0
    assert subject[owner == TABLE].mean() < 0.01


def test_the_table_is_the_ground_that_heights_are_above(seen):
    ground, means = Ground.under(*seen), seen[0].means
    assert ground.is_found
    np.testing.assert_allclose(ground.plane.heights(means), -means[:, 1], atol=0.06)  # up is -y
    np.testing.assert_array_equal(of("height:..50%", *seen) + of("height:50%..", *seen), 1)
    assert of("height:0.2..1 and height:..0.1", *seen).sum() == 0


def test_parts_are_numbered_by_their_painted_area_or_named_by_a_point():
    gaussians = balls((0, 0, 0), num=300) + balls((5, 0, 0), radius=1.5, num=700)
    view = around(gaussians)
    assert of("part:1", gaussians, view).tolist() == [0] * 300 + [1] * 700
    assert of("part:2", gaussians, view).tolist() == [1] * 300 + [0] * 700
    assert of("part:0,1.2,0", gaussians, view).tolist() == [1] * 300 + [0] * 700
    with pytest.raises(ValueError, match="part:3 is not there; the subject has 2 connected parts"):
        of("part:3", gaussians, view)


def test_faint_and_huge_gaussians_link_nothing():
    haze = gaussians_at([[1.5, 0, 0], [1.4, 0, 0], [1.6, 0, 0]], 3.0, opacity=0.8, dtype=np.float32)
    parts = connected_parts(balls((0, 0, 0), (3, 0, 0)) + haze)
    assert parts[0] != parts[800]
    np.testing.assert_array_equal(parts[:1600], np.repeat(parts[[0, 800]], 800))


@for_each("text", ["subject", "part:1", "part:2 or height:60%..", "height:20%..50% and not part:1"])
@for_each("soft", [0.0, 0.2])
def test_neither_the_unit_nor_a_rotation_matters(text, soft):
    gaussians = balls((0, 0, 0), num=500) + balls((0.2, -3, 0.3), radius=0.9, num=400)
    gaussians += balls((2.7, 0, 0.1), radius=0.8, num=300) + balls((0, 6, 0), num=100)
    view = around(gaussians.take(slice(0, 1200)))  # the last part lies beside the hull
    expected = of(text, gaussians, view, soft)
    assert 0 < expected.sum() < len(expected)
    for unit in (1e-4, 3e5):
        found = of(text, rescaled(gaussians, unit), replace(view, points=view.points * unit), soft)
        np.testing.assert_allclose(found, expected, atol=2e-4)
    quat = turn((0.1, -0.5, 0.3), 1.3)
    turned = moved(gaussians.astype(np.float64), quat, (0, 0, 0))
    matrix = rotation_matrices(quat[None])[0]
    found = of(text, turned, FirstView(view.points @ matrix.T, matrix @ view.up, 0.0, 0.0), soft)
    np.testing.assert_allclose(found, expected, atol=1e-3)


@for_each("text", ["subject", "surroundings", "part:1", "part:0,0,0", "height:10%..", "colour:#808080,0.1"])
@for_each("soft", [0.0, 0.3])
def test_none_one_and_extreme_gaussians_have_memberships(text, soft):
    some = balls((0, 0, 0), num=50)
    assert len(of(text, some.take(slice(0, 0)), around(some), soft)) == 0
    far = np.float32(1e30) * some.means
    strays = np.where(np.arange(50)[:, None] < 3, far, some.means)
    flat = some.means * np.float32([1, 0, 1])
    others = [replace(some, means=means) for means in (flat, 0 * flat, strays)]
    points = replace(some, means=far, scales=0 * some.scales)
    for gaussians in (some.take([0]), points, *others):
        with np.errstate(all="ignore"):
            found = of(text, gaussians, around(gaussians), soft)
        assert found.shape == (len(gaussians),)
        assert ((found >= 0) & (found <= 1)).all()
