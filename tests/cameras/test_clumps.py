import numpy as np

import brushgs as bg
from brushgs.cameras.clumps import heaviest_clump
from tests.kit.for_each import for_each
from tests.passes.scenes import random_gaussians, replaced

ONES = np.ones(1000)


def places(seed=0):
    return np.random.default_rng(seed).normal(size=(1000, 3))


@for_each("unit", [2.0**-60, 1.0, 2.0**60])
@for_each("axis", range(3))
def test_the_heaviest_of_several_clumps_is_found_along_any_axis(axis, unit):
    means = places()
    means[300:, axis] += 1e4
    means[800:, (axis + 1) % 3] -= 1e5
    expected = np.zeros(1000, bool)
    expected[300:800] = True
    np.testing.assert_array_equal(heaviest_clump(unit * means, ONES), expected)
    weights = np.where(np.arange(1000) < 300, 10.0, 1.0)
    np.testing.assert_array_equal(heaviest_clump(unit * means, weights), np.arange(1000) < 300)


def test_a_frame_holds_the_heavier_clump():
    scene = random_gaussians(1000)
    means = scene.means.copy()
    means[600:] += 1e6
    framed = bg.frame_scene(replaced(scene, means=means), width=64, height=48)
    alone = bg.frame_scene(scene.take(slice(0, 600)), width=64, height=48)
    np.testing.assert_allclose(framed.viewmat, alone.viewmat, atol=1e-6)
