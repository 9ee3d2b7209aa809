"""Levels of brushes as the page makes them, against `brushgs/brushes/levels.py`."""

import numpy as np
import pytest

import brushgs as bg
from brushgs.brushes.levels import axis_levels, level_coverage, level_height
from brushgs.rendering.relief import paint_height
from tests.kit.for_each import for_each


@for_each("num_texels", [1, 2, 3, 13, 91, 256])
def test_axes_have_the_same_levels(studio, num_texels):
    found, expected = studio.axis_levels(num_texels), axis_levels(num_texels)
    assert [level["numTexels"] for level in found] == [level.num_texels for level in expected]
    assert [level["scale"] for level in found] == [level.scale for level in expected]
    assert [level["footprint"] for level in found] == pytest.approx([level.footprint for level in expected])


@for_each("name", ["flat", "line"])
@for_each("level_u", [0, 1, 4, 9, 20])
def test_texels_are_those_of_python(studio, name, level_u):
    brush = bg.StrokeTexture.open(name)
    height = paint_height(brush)
    levels_v = range(0, len(axis_levels(len(height))), 2)
    both = studio.levels(brush.coverage, height, level_u, levels_v)
    alone = studio.levels(brush.coverage, None, level_u, levels_v)
    for level_v, texels, coverage in zip(levels_v, both, alone, strict=True):
        paint = level_coverage(brush.coverage, level_u, level_v)
        relief = level_height(height, brush.coverage, level_u, level_v)
        difference = np.abs(texels.astype(int) - np.stack([paint, relief], axis=2))
        assert difference.max() <= 1
        assert difference[paint > 0].mean() < 0.01  # where no paint is, 127.5 is rounded either way
        np.testing.assert_array_equal(coverage[:, :, 0], texels[:, :, 0])
