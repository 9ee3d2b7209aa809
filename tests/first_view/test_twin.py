"""Subject, up and front: the core against NumPy."""

import numpy as np
import pytest

import brushgs as bg
from brushgs.cameras.clumps import heaviest_clump
from brushgs.cameras.framing import AXES, camera_axes, subject, weighted_quantiles
from brushgs.core.native import core as _core
from brushgs.first_view.front import find_front, wrapped
from brushgs.first_view.sample import take_sample, thinned
from tests.first_view import twin
from tests.first_view.scenes import about, moved, on_a_plaza, statue
from tests.kit.for_each import for_each
from tests.passes.scenes import random_gaussians

SCENES = {
    "statue": statue(),
    "in surroundings": on_a_plaza(),
    "leaning": moved(statue(), rotation=about((1, 2, 3), 50)),
    "a cloud": random_gaussians(400, size=0.01),
    "two clumps": bg.Gaussians.joined([statue(), moved(statue(), offset=(900, 0, 0)).take(slice(0, 900))]),
    "one Gaussian": statue().take([5]),
    "unseen": random_gaussians(9, size=1e9),
}


@for_each("name", SCENES)
@for_each("dtype", [np.float32, np.float64])
def test_subject_and_clump_are_those_of_the_twin(name, dtype):
    scene = SCENES[name].astype(dtype)
    for is_whole in (False, True):
        points, has_surroundings = twin.subject(scene, is_whole=is_whole)
        found = subject(scene, is_whole=is_whole)
        np.testing.assert_array_equal(found[0], points)
        assert found[1] == has_surroundings
    expected = twin.heaviest_clump(scene.means, scene.opacities)
    found = heaviest_clump(scene.means, scene.opacities)
    assert (expected is None) == (found is None) == (name != "two clumps")
    if found is not None:
        np.testing.assert_array_equal(found, expected)


def test_thinned_rows_and_weighted_quantiles_are_those_of_the_twin():
    for count, most in ((0, 5), (7, 7), (100_000, 30_000), (31, 30)):
        np.testing.assert_array_equal(thinned(count, most), twin.thinned(count, most))
    rng = np.random.default_rng(0)
    values, weights = rng.normal(size=500).round(1), rng.random(500)
    at = (0.0, 0.1, 0.5, 1.0)
    assert weighted_quantiles(values, weights, at) == twin.weighted_quantiles(values, weights, at)


@for_each("name", SCENES)
def test_evidence_of_up_is_that_of_the_twin(name):
    """Pictures are painted in radii of the scene, not in its unit: colors round apart."""
    scene = SCENES[name]
    expected, found = twin.take_sample(scene), take_sample(scene)
    if expected is None:
        assert found is None
        return
    assert (found.count, found.num_rows) == (len(expected.gaussians), expected.num_rows)
    values = _core.measure_up(found, 1)
    for kind, columns in twin.measure_up(expected).items():
        tolerance = 3e-4 if "size" in kind or "edges" in kind else 1e-6
        np.testing.assert_allclose(values[kind], columns, rtol=1e-6, atol=tolerance, err_msg=kind)
    np.testing.assert_array_equal(_core.measure_up(found, 3)["edges"], values["edges"])


@for_each("name", ["statue", "in surroundings", "leaning"])
@for_each("axis", ["-y", "+z", "-x"])
def test_the_front_is_that_of_the_twin(name, axis):
    scene, up = SCENES[name], np.array(AXES[axis])
    azimuth, lean, margin, likeness = twin.find_front(twin.take_sample(scene), up)
    found = find_front(take_sample(scene), up)
    assert abs(wrapped(found.azimuth - azimuth)) < 1e-9
    assert found.lean == lean
    assert found.margin == pytest.approx(margin, abs=0.02)
    assert found.likeness == pytest.approx(likeness, rel=1e-3)


def test_overlap_with_the_mirror_image_is_that_of_the_twin():
    rng = np.random.default_rng(0)
    places, weights = rng.uniform(-1, 1, (3000, 3)) * (1, 1, 0.4), rng.random(3000)
    turned = np.ascontiguousarray(places @ camera_axes(np.array([0.3, -1, 0]), 0.0, 0.0).T)
    expected = twin.mirror_likeness(turned, weights)
    np.testing.assert_allclose(_core.mirror_likeness(turned, weights), expected, rtol=1e-9)
    assert set(_core.mirror_likeness(np.zeros((5, 3)), np.zeros(5))) == {1.0}
