"""Opacities change over a stated time."""

import numpy as np

from brushgs.passes.motion.rows import FADE, faded


def test_it_is_the_largest_of_all_moments_less_the_distance_in_time():
    rng = np.random.default_rng(0)
    times = np.sort(rng.uniform(0, 2, 40))
    opacities = (rng.uniform(size=(40, 7)) * (rng.uniform(size=(40, 7)) < 0.2)).astype(np.float32)
    for fade, found in ((0.3, faded(opacities, times, 0.3)), (FADE, faded(opacities, times))):
        falls = np.abs(times[:, None] - times[None]) / fade
        expected = (opacities[None] - falls[..., None]).max(axis=1)
        np.testing.assert_allclose(found, expected, atol=1e-6)


def test_no_time_is_as_it_was():
    opacities = np.float32([[0], [1], [0.25]])
    np.testing.assert_array_equal(faded(opacities, np.array([0.0, 0.1, 0.2]), 0.0), opacities)
