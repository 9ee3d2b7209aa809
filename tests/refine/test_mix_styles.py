"""Several styles for `refine --style`: colors in their shares, means of marks, brushes of all."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.formats.styles import write_style
from brushgs.options.styling import StyleConfig
from brushgs.refine.mix_styles import mixed, open_styles
from brushgs.refine.painting_style import open_style
from tests.io.styles import example


def styles():
    first = example.painting()
    one = {"directions": -first.marks.directions[:5], "brushes": first.marks.brushes[:1]}
    marks = replace(first.marks, length=0.01, aspect=2.0, **one)
    return first, replace(first, name="other", marks=marks)


def test_a_mix_has_all_colors_in_their_shares_and_the_means_of_marks():
    first, second = styles()
    style = mixed([first, second], StyleConfig.parse("a:0.6,b:0.2"))
    shares = [color.share for color in style.palette.colors]
    assert sum(shares) == pytest.approx(1)
    assert sum(shares[:3]) == pytest.approx(0.75)
    assert np.log(style.marks.length) == pytest.approx(0.75 * np.log(0.043) + 0.25 * np.log(0.01))
    assert style.marks.directions.shape == first.marks.directions.shape
    assert len(style.marks.brushes) == 3


@pytest.mark.parametrize(
    ("text", "colors", "length"),
    [("a;color=0,b:0", 3, 0.043), ("a:0.5;marks=0,b:0.5", 6, 0.01), ("a:0.5;marks=0,b:0.5;marks=0", 6, None)],
)
def test_dials_leave_properties_out(text, colors, length):
    style = mixed(styles(), StyleConfig.parse(text))
    assert len(style.palette.colors) == colors
    assert (style.marks and style.marks.length) == (length and pytest.approx(length))


def test_one_style_that_is_taken_wholly_stays_as_it_is(tmp_path):
    path = tmp_path / "a.style"
    write_style(example.painting(), path)
    only, whole = open_style(path), open_styles(StyleConfig.parse(str(path)))
    np.testing.assert_array_equal(whole.painting, only.painting)
    half = open_styles(StyleConfig.parse(f"{path}:0.5;direction=0"))
    np.testing.assert_array_equal(half.painting, only.painting)
    assert not half.style.marks.directions.any()
