"""The numbers of a look on the way to those of styles."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.options.look import Look
from brushgs.options.painting import PaintConfig
from brushgs.passes.add.backdrop import Tone
from brushgs.pipeline.style_values import count_of, style_values
from brushgs.values.colors import oklab_of, rgb_of, rgb_of_oklab
from brushgs.values.style import Style, StyleMarks

MARKS = StyleMarks(0.04, 2.0, np.zeros((2, 2, 2), np.float32), broken_lightness=0.03, relief=0.2)
MARKS = replace(MARKS, ground=np.array([0.2, 0.3, 0.4]))


def style_of(**fields):
    return Style("a", marks=replace(MARKS, **fields))


OIL = Look.open("oil").values


def test_no_share_and_no_marks_leave_the_look():
    for styles in ([], [(style_of(), 0.0)], [(Style("edit"), 1.0)]):
        assert style_values(styles, OIL) is OIL


def test_numbers_go_from_those_of_the_look_to_those_of_the_style():
    for share in (0.25, 0.5, 1.0):
        config = PaintConfig.of(style_values([(style_of(), share)], OIL))
        assert config.strokes.broken_color == pytest.approx(0.016 + share * (0.03 - 0.016))
        assert config.light.relief == pytest.approx(0.6 + share * (0.2 - 0.6))
        assert config.light.gain == 1.7
        expected = 6000 ** (1 - share) * count_of(MARKS) ** share
        assert config.cluster.strokes.count == pytest.approx(expected, abs=1)
    assert OIL["light"]["relief"] == 0.6  # untouched


def test_smaller_marks_ask_for_more_strokes_within_limits():
    counts = [count_of(replace(MARKS, length=length)) for length in (0.005, 0.02, 0.03, 0.06, 0.9)]
    assert counts == sorted(counts, reverse=True)
    assert counts[2] == pytest.approx(4 * counts[3], rel=0.01)
    assert counts[0] == 20_000
    assert counts[-1] == 2400


def test_a_toned_ground_goes_from_its_tone_to_the_ground_of_the_style():
    mean = np.array([0.5, 0.1, -0.05])

    def lab(share):
        ground = PaintConfig.of(style_values([(style_of(), share)], OIL)).ground
        return Tone(ground.lightness, ground.complement, ground.warmth).lab(mean)

    start = Tone(0.58, 0.6, (0.012, 0.04)).lab(mean)
    np.testing.assert_allclose(rgb_of_oklab(lab(1.0)[None])[0], MARKS.ground, atol=1e-6)
    np.testing.assert_allclose(lab(0.5), 0.5 * (start + oklab_of(MARKS.ground[None])[0]), atol=1e-9)


def test_a_ground_of_one_color_is_mixed_and_others_stay_as_do_counts_that_are_not_usual():
    def values(look, share=1.0, **fields):
        return style_values([(style_of(**fields), share)], look)

    for ground, code in (("canvas", "#dccfb8"), ("#804020", "#804020"), ("navy", "navy")):
        mixed = values({"ground": {"ground": ground}}, 0.5)["ground"]["ground"]
        wanted = 0.5 * (np.array(rgb_of(code)) + MARKS.ground)
        np.testing.assert_allclose(rgb_of(mixed), wanted, atol=0.5 / 255)
    for ground in ("none", "picture.png"):
        assert values({"ground": {"ground": ground}})["ground"] == {"ground": ground}
    assert "ground" not in values({"draw": {}}, ground=None)
    for asked in ("auto", 0.1, None, 5000):
        assert values({"cluster": {"strokes": asked}})["cluster"] == {"strokes": asked}
