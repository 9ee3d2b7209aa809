import numpy as np
import pytest

import brushgs as bg
from tests.kit.for_each import for_each
from tests.passes.color import broken_color_twin as twin
from tests.passes.scenes import colors_of, random_gaussians, strange_strokes


@for_each(
    ("options", "error"),
    [
        *(({"lightness": value}, ValueError) for value in (-0.1, np.nan)),
        *(({"follows": value}, ValueError) for value in (-0.1, 1.1, np.nan)),
        ({"chroma": 0.6}, ValueError),
        ({"seed": -1}, ValueError),
        ({"seed": 0.5}, TypeError),
    ],
)
def test_options_out_of_range(options, error):
    strokes = random_gaussians(3)
    with pytest.raises(error):
        bg.break_colors(strokes, **options)
    assert bg.break_colors(strokes, 0, 0) is strokes


@for_each("name", strange_strokes())
@for_each("dtype", [np.float32, np.float64])
@for_each("follows", [0.0, 0.6])
def test_broken_colors_are_those_of_the_twin(name, dtype, follows):
    strokes = strange_strokes()[name].astype(dtype)
    if not len(strokes):
        return
    broken = bg.break_colors(strokes, 0.05, 0.03, follows=follows, seed=7)
    before, after = twin.base_colors(strokes, 0.05, 0.03, follows, 7)
    np.testing.assert_array_equal(broken.sh[:, 1:], strokes.sh[:, 1:])
    # Where both directions just fit, rounding decides about the last of the bisections, 1/256 of a shift.
    off = np.abs(colors_of(broken) - after).max(axis=1) > 1e-6
    assert off.mean() <= 0.05
    assert (np.abs(colors_of(broken) - after) <= np.abs(after - before).max() / 100 + 1e-6).all()
