"""What first views frame, and crumbs below it: the core against NumPy."""

import numpy as np

from brushgs.cameras.framing import fit_eye, plain_first_view, subject
from brushgs.first_view.attached import with_attached
from brushgs.first_view.surroundings import dense_middle, has_surroundings
from brushgs.passes.reduce.crumbs import find_crumbs
from brushgs.values.gaussians import Gaussians
from tests.first_view import framing_twin
from tests.first_view.scenes import gaussians, joined, on_a_plaza, statue
from tests.first_view.test_twin import SCENES
from tests.kit.for_each import for_each
from tests.passes.reduce.test_crumbs import block, smears

UP = np.array([0.0, -1.0, 0.0])


def with_legs(seed):
    """A statue on legs of little opacity, among floaters."""
    rng = np.random.default_rng(seed)
    places = rng.uniform((-0.7, -1.2, -0.7), (0.7, 1.2, 0.7), (600, 3))
    places[:400, [0, 2]] = places[:400, [0, 2]] * 0.06 + rng.choice([-0.5, 0.5], (400, 2))
    normals = np.tile(UP, (600, 1))
    return joined(statue(), gaussians(places, normals, 0.03, (0.3, 0.3, 0.3), 0.1))


@for_each("name", SCENES)
@for_each("dtype", [np.float32, np.float64])
def test_surroundings_and_dense_middles_are_those_of_the_twin(name, dtype):
    scene = SCENES[name].astype(dtype)
    found = [has_surroundings(scene, UP), framing_twin.has_surroundings(scene, UP)]
    assert found == [name == "in surroundings"] * 2
    np.testing.assert_array_equal(dense_middle(scene), framing_twin.dense_middle(scene))


@for_each("share", np.linspace(0.3, 1.0, 8))
def test_surroundings_end_where_the_twin_ends_them(share):
    scene, statue_rows = on_a_plaza(), len(statue())
    rng = np.random.default_rng(0)
    near = np.linalg.norm(scene.means - scene.means[:statue_rows].mean(axis=0), axis=1)
    scene = scene.take((near < np.quantile(near, share)) & (rng.random(len(scene)) < 0.9))
    assert has_surroundings(scene, UP) == framing_twin.has_surroundings(scene, UP)


@for_each("seed", range(4))
@for_each("dtype", [np.float32, np.float64])
def test_attached_parts_are_those_of_the_twin(seed, dtype):
    scene = with_legs(seed).astype(dtype)
    points, _ = subject(statue())
    found = with_attached(scene, points)
    np.testing.assert_array_equal(found, framing_twin.with_attached(scene, points))
    assert len(points) < len(found) < len(points) + len(scene) - len(statue())
    np.testing.assert_array_equal(with_attached(scene, points[:1]), points[:1])


@for_each("seed", range(6))
def test_eyes_are_those_of_the_twin(seed):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(int(rng.integers(1, 60)), 3)) * rng.uniform(0, 5, 3) + rng.normal(size=3)
    for tangents in rng.uniform(0.05, 9, (20, 2)):
        place, distance = fit_eye(points, tangents)
        expected = framing_twin.fit_eye(points, tangents)
        np.testing.assert_allclose(place, expected[0], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(distance, expected[1], rtol=1e-12)
    origin = fit_eye(np.zeros((2, 3)), np.ones(2))
    np.testing.assert_allclose(origin[0], framing_twin.fit_eye(np.zeros((2, 3)), np.ones(2))[0], atol=1e-15)


@for_each("seed", range(8))
@for_each("dtype", [np.float32, np.float64])
def test_crumbs_are_those_of_the_twin(seed, dtype):
    """Streaks of all sizes, opacities and directions around the foot of a block."""
    rng = np.random.default_rng(seed)
    count = 60
    places = rng.uniform((-0.4, -0.4, -0.15), (0.4, 0.4, 0.1), (count, 3))
    streaks = smears()
    quats, scales = rng.normal(size=(count, 4)), rng.uniform(0.3, 5, (count, 3)) * 0.01
    opacities = rng.uniform(0.02, 0.3, count)
    turned = Gaussians(places, quats, scales, opacities, np.zeros((count, 1, 3))).astype(np.float32)
    scene = Gaussians.joined([block(seed), streaks, turned]).astype(dtype)
    view = plain_first_view(block(seed), np.array([0.0, 0.0, 1.0]))
    found = find_crumbs(scene, view)
    np.testing.assert_array_equal(found, framing_twin.find_crumbs(scene, view))
    assert 0.15 < found[4000:].mean() < 0.9
    heavy = Gaussians.joined([block(seed).take(slice(0, 400)), streaks, streaks])
    assert not find_crumbs(heavy, view).any()
    assert not framing_twin.find_crumbs(heavy, view).any()
