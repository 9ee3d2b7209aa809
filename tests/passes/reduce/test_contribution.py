import numpy as np
import pytest
from scipy.special import elliprg

from brushgs.core.native import core as _core
from brushgs.passes.reduce.contribution import projected_areas


def surface(a, b, c):
    """Surface of an ellipsoid by Carlson's symmetric integral."""
    return 4 * np.pi * elliprg(a * a * b * b, a * a * c * c, b * b * c * c)


def test_projected_area_is_a_quarter_of_the_surface():
    scales = np.exp(np.random.default_rng(0).uniform(-8, 2, (500, 3)))
    expected = np.array([surface(*row) for row in scales]) / (4 * np.pi)
    # 1.1 % is the known bound of the formula, 1.06 % the worst of these.
    for unit in (1, 1e-120, 1e120):
        np.testing.assert_allclose(projected_areas(scales * unit) / unit / unit, expected, rtol=0.0115)
    assert projected_areas(np.zeros((1, 3)))[0] == 0


@pytest.mark.parametrize("reach", [0.0, 0.3, 100.0])
def test_light_passes_what_lies_within_reach_and_not_at_the_same_place(reach):
    rng = np.random.default_rng(3)
    places, depths = np.round(10 * rng.random(400), 1), rng.integers(0, 9, 400).astype(float)
    above, below = np.empty((2, 400))
    _core.light_along(places, depths, reach, above, below)
    for i, place in enumerate(places):
        is_above = (places > place) & (places <= place + reach)
        is_below = (places < place) & (places >= place - reach)
        assert above[i] == -depths[is_above].sum()
        assert below[i] == -depths[is_below].sum()
