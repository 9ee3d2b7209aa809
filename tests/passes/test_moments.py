"""The core against the NumPy twin, on scenes of every strange kind, and in any number of threads."""

import numpy as np

from brushgs.core.threads import at_most
from brushgs.passes.groups import Groups
from brushgs.passes.reduce.contribution import projected_areas
from brushgs.passes.reduce.merge import covariances, stopped
from tests.kit.for_each import for_each
from tests.passes import moments_twin as twin
from tests.passes.scenes import covariances as covariances_of
from tests.passes.scenes import random_gaussians, replaced, strange_strokes

STRANGE = strange_strokes()
NUM_GROUPS = 7
SCALARS = [np.float32, np.float64]


def groups_of(scene):
    labels = np.random.default_rng(1).integers(0, NUM_GROUPS - 1, len(scene)).astype(np.int32)
    return labels, Groups.of(labels, NUM_GROUPS)  # the last has no rows


def with_threads(work):
    """The result of one thread, which must be that of three."""
    with at_most(1):
        alone = work()
    with at_most(3):
        several = work()
    for one, other in zip(alone, several, strict=True):
        np.testing.assert_array_equal(one, other)
    return alone


@for_each("name", STRANGE)
@for_each("dtype", SCALARS)
def test_areas_are_those_of_the_formula(name, dtype):
    scales = STRANGE[name].astype(dtype).scales
    found = with_threads(lambda: projected_areas(scales))
    np.testing.assert_allclose(found, twin.areas(scales), rtol=2e-14)


@for_each("name", STRANGE)
@for_each("dtype", SCALARS)
def test_covariances_within_and_between_are_those_of_the_twin(name, dtype):
    scene = STRANGE[name].astype(dtype)
    labels, groups = groups_of(scene)
    shares = twin.shares_by_label(scene.opacities * projected_areas(scene.scales), labels, NUM_GROUPS)
    means = groups.sums(scene.means, shares)
    found = with_threads(lambda: covariances(scene, means, shares, groups))
    own = covariances_of(scene.astype(np.float64))
    for one, expected in zip(found, twin.within_and_between(scene, own, means, shares, labels), strict=True):
        size = np.abs(expected).max(axis=(1, 2), keepdims=True)
        assert (np.abs(one - expected) <= 1e-12 * size).all()
        np.testing.assert_array_equal(one, one.transpose(0, 2, 1))


@for_each("dtype", SCALARS)
@for_each("footprint", [0.0, 0.01, 1.0, 1e30])
def test_what_stops_a_ray_is_the_product_of_what_passes_each(dtype, footprint):
    scene = random_gaussians(80).astype(dtype)
    some = [0, 1, 1e-30, 1e-9, 1 - 1e-7, 0.99]
    scene = replaced(scene, opacities=np.concatenate([some, scene.opacities[6:]]).astype(dtype))
    labels, groups = groups_of(scene)
    own = projected_areas(scene.scales)
    footprints = np.full(NUM_GROUPS, footprint)
    found = with_threads(lambda: stopped(scene.opacities, own, footprints, groups))
    np.testing.assert_allclose(found, twin.stopped(scene.opacities, own, footprints, labels), atol=1e-13)
    assert found[-1] == 0
    if footprint == 1e30:  # where hardly anything is stopped, it is the sum of what each stops
        expected = np.bincount(labels, scene.opacities * own / footprint, NUM_GROUPS)
        np.testing.assert_allclose(found, expected, rtol=1e-13)
