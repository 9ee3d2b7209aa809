import numpy as np
import pytest

import brushgs as bg
from tests.passes.scenes import gaussians_at, grid


def layer(side=8, *, opacity=0.5, size=0.5, z=0.0):
    """Flat round strokes on a lattice of step 1 in the plane z, grey."""
    means = grid(side, (side - 1) / 2, z) + np.array([1, 1, 0]) * (side - 1) / 2
    return gaussians_at(means, (size, size, 0.01 * size), opacity=opacity)


def joined(*parts):
    return bg.Gaussians.joined(parts)


def paint(strokes):
    return strokes.opacities * np.prod(np.sort(strokes.scales.astype(float), axis=1)[:, 1:], axis=1)


def test_paint_is_kept_and_opacity_grows_to_two_coats_where_the_surface_is_closed():
    strokes = joined(*(layer(opacity=0.6, size=1.5, z=0.001 * k) for k in range(3)))
    solid = bg.solidify(strokes)
    np.testing.assert_allclose(paint(solid), paint(strokes), rtol=1e-12)
    np.testing.assert_allclose(solid.opacities[27:36], 1 - 0.4**2, atol=1e-3)
    np.testing.assert_array_equal(solid.means, strokes.means)
    assert bg.solidify(strokes, 0) is strokes
    for strength in (-0.1, 1.5, np.nan):
        with pytest.raises(ValueError, match=r"solidify: strength must be in \[0, 1\]"):
            bg.solidify(strokes, strength)
    half = bg.solidify(strokes, 0.5)
    np.testing.assert_allclose(half.opacities - 0.6, (solid.opacities - 0.6) / 2, rtol=1e-9)


def test_haze_stays_haze_and_opaque_strokes_stay_as_they_are():
    haze = layer(opacity=0.05, size=0.3)
    assert bg.solidify(haze).opacities.max() < 1.2 * 0.05
    opaque = layer(opacity=1.0)
    solid = bg.solidify(opaque)
    np.testing.assert_array_equal(solid.scales, opaque.scales)
    np.testing.assert_array_equal(solid.opacities, opaque.opacities)
