"""The subject, its surroundings, heights above the ground and connected parts."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.first_view import find_first_view
from brushgs.options.where import Where
from brushgs.passes.where import WhereContext, memberships
from brushgs.passes.where.ground import Ground
from brushgs.passes.where.parts import connected_parts
from brushgs.still_life.bodies import bodies
from brushgs.still_life.cast import cast_of, joined
from brushgs.values.camera import FirstView
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices
from tests.kit.for_each import for_each
from tests.scenes import still_life_of

WALL, TABLE, JUG, ORANGES = 0, 1, range(3, 5), range(7, 11)
COUNT = 50_000


@pytest.fixture(scope="module")
def scene():
    return still_life_of(COUNT)


@pytest.fixture(scope="module")
def owner():
    rng = np.random.default_rng(0)
    cast = joined([cast_of(body, i, rng) for i, body in enumerate(list(bodies(COUNT, rng)))])
    return cast.surface.bodies[cast.opacities > 1 / 255]


@pytest.fixture(scope="module")
def view(scene):
    return find_first_view(scene)


def of(text, scene, view, soft=0.0):
    return memberships(Where.parse(text), scene, WhereContext(view, soft))


def balls(*centers, num=800, radius=1.0, seed=0):
    """Balls of Gaussians that touch each other inside of each ball."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(num, 3))
    points *= radius / np.linalg.norm(points, axis=1, keepdims=True)
    means = np.concatenate([points + center for center in np.array(centers, float)]).astype(np.float32)
    n = len(means)
    quats = rng.normal(size=(n, 4)).astype(np.float32)
    size = np.float32(2.0 * radius / np.sqrt(num))
    return Gaussians(
        means, quats, np.full((n, 3), size), np.full(n, np.float32(0.8)), np.zeros((n, 1, 3), np.float32)
    )


def around(gaussians, up=(0.0, -1.0, 0.0)):
    return FirstView(gaussians.means.astype(float), np.array(up), 0.0, 0.0)


def test_the_subject_of_the_still_life_stands_on_the_table_before_the_wall(scene, owner, view):
    subject = of("subject", scene, view) == 1
    assert subject[np.isin(owner, JUG)].mean() > 0.9
    assert subject[np.isin(owner, ORANGES)].mean() > 0.95
    assert subject[owner == WALL].mean() == 0
    assert subject[owner == TABLE].mean() < 0.01


def test_the_table_is_the_ground_that_heights_are_above(scene, owner, view):
    ground = Ground.under(scene, view)
    assert ground.is_found
    heights = ground.plane.heights(scene.means)
    np.testing.assert_allclose(heights, -scene.means[:, 1], atol=0.06)  # y is down, the table is at 0
    low, high = of("height:..50%", scene, view), of("height:50%..", scene, view)
    np.testing.assert_array_equal(low + high, 1)
    assert of("height:0.2..1 and height:..0.1", scene, view).sum() == 0


def test_parts_are_numbered_by_their_painted_area_or_named_by_a_point():
    gaussians = Gaussians.joined([balls((0, 0, 0), num=300), balls((5, 0, 0), radius=1.5, num=700)])
    view = around(gaussians)
    assert of("part:1", gaussians, view).tolist() == [0] * 300 + [1] * 700
    assert of("part:2", gaussians, view).tolist() == [1] * 300 + [0] * 700
    assert of("part:0,1.2,0", gaussians, view).tolist() == [1] * 300 + [0] * 700
    with pytest.raises(ValueError, match="part:3 is not there; the subject has 2 connected parts"):
        of("part:3", gaussians, view)


def test_faint_and_huge_gaussians_link_nothing():
    gaussians = balls((0, 0, 0), (3, 0, 0))
    haze = gaussians.take(np.arange(3))
    haze = replace(
        haze,
        means=np.array([[1.5, 0, 0], [1.4, 0, 0], [1.6, 0, 0]], np.float32),
        scales=np.full((3, 3), np.float32(3)),
    )
    parts = connected_parts(Gaussians.joined([gaussians, haze]))
    assert parts[0] != parts[800]
    assert (parts[:800] == parts[0]).all()
    assert (parts[800:1600] == parts[800]).all()


TEXTS = ("subject", "part:1", "part:2 or height:60%..", "height:20%..50% and not part:1")


@for_each("text", TEXTS)
@for_each("soft", [0.0, 0.2])
def test_neither_the_unit_nor_the_order_nor_a_rotation_matters(text, soft):
    parts = [balls((0, 0, 0), num=500), balls((0.2, -3, 0.3), radius=0.9, num=400)]
    parts += [
        balls((2.7, 0, 0.1), radius=0.8, num=300),
        balls((0, 6, 0), num=100),
    ]
    gaussians = Gaussians.joined(parts)
    view = around(gaussians.take(slice(0, 1200)))  # the last part lies beside the hull
    expected = of(text, gaussians, view, soft)
    assert 0 < expected.sum() < len(expected)
    for unit in (1e-4, 3e5):
        scaled = replace(
            gaussians, means=gaussians.means * np.float32(unit), scales=gaussians.scales * np.float32(unit)
        )
        found = of(text, scaled, replace(view, points=view.points * unit), soft)
        np.testing.assert_allclose(found, expected, atol=2e-4)
    order = np.random.default_rng(1).permutation(len(gaussians))
    np.testing.assert_allclose(of(text, gaussians.take(order), view, soft), expected[order], atol=1e-12)
    quat = np.array([0.8, 0.1, -0.5, 0.3])
    turn = rotation_matrices(quat[None])[0]
    w, x, y, z = quat / np.linalg.norm(quat)
    left = np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])
    turned = replace(
        gaussians.astype(np.float64),
        means=gaussians.means @ turn.T,
        quats=gaussians.quats.astype(float) @ left.T,
    )
    found = of(text, turned, FirstView(view.points @ turn.T, turn @ view.up, 0.0, 0.0), soft)
    np.testing.assert_allclose(found, expected, atol=1e-3)


EVERY = [
    "subject",
    "surroundings",
    "part:1",
    "part:0,0,0",
    "height:10%..",
    "box:-1,-1,-1,1,1,1",
    "sphere:0,0,0,1",
    "half:0,1,0,0",
    "colour:#808080,0.1",
]


@for_each("text", EVERY)
@for_each("soft", [0.0, 0.3])
def test_none_one_and_extreme_gaussians_have_memberships(text, soft):
    some = balls((0, 0, 0), num=50)
    assert len(of(text, some.take(slice(0, 0)), around(some), soft)) == 0
    one = some.take(slice(0, 1))
    far = replace(some, means=some.means * np.float32(1e30), scales=some.scales * 0)
    flat = replace(some, means=some.means * np.array([1, 0, 1], np.float32))
    same = replace(some, means=some.means * 0)
    mixed = replace(some, means=np.where(np.arange(50)[:, None] < 3, np.float32(1e30), some.means))
    for gaussians in (one, far, flat, same, mixed):
        with np.errstate(all="ignore"):
            found = of(text, gaussians, around(gaussians), soft)
        assert found.shape == (len(gaussians),)
        assert np.isfinite(found).all()
        assert found.min() >= 0
        assert found.max() <= 1
