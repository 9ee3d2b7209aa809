"""Numbers of strokes as the command line takes them: counts, shares and targets."""

import re

import numpy as np
import pytest

import brushgs as bg
from brushgs.passes.reduce import cluster as passes
from brushgs.still_life import still_life_camera
from tests.kit import for_each, still_life_of
from tests.passes.scenes import assert_same

VIEW = still_life_camera(width=120, height=90)


PEARS = still_life_of(1000)


def test_a_count_a_share_and_all_are_those_of_the_pass():
    for number in (200, "200", np.int64(200), "+200"):
        assert_same(bg.cluster(PEARS, number, seed=3), passes.cluster(PEARS, 200, seed=3))
    for number in (0.1, "10%", "10.0%", np.float32(0.1)):  # rounded up
        assert len(bg.cluster(PEARS, number)) == np.ceil(0.1 * len(PEARS) - 1e-3)
    assert bg.cluster(PEARS, "all") is bg.cluster(PEARS, 1.0) is PEARS


def test_auto_is_the_number_that_is_chosen_for_a_view_or_for_that_of_a_painting():
    for given, view in (({"camera": VIEW}, VIEW), ({}, bg.frame_scene(PEARS))):
        chosen = bg.choose_strokes(PEARS, view, "flat").strokes
        assert_same(bg.cluster(PEARS, "auto", texture="flat", **given), passes.cluster(PEARS, chosen))


@for_each("sees", [False, True])
def test_a_budget_is_reached_and_a_smaller_one_takes_no_more_strokes(sees):
    views = bg.plain_views(PEARS, [VIEW]) if sees else None
    plain = bg.render(PEARS, VIEW, "gaussian").over("white").clip(0, 1)
    counts = []
    for decibels in (16, 18):
        strokes = bg.cluster(PEARS, f"{decibels}dB", camera=VIEW, texture="flat", views=views)
        painted = bg.render(strokes, VIEW, "flat").over("white").clip(0, 1)
        assert -10 * np.log10(np.mean(np.square(painted - plain, dtype=np.float64))) >= decibels - 1e-3
        counts.append(len(strokes))
    assert counts[0] <= counts[1] < len(PEARS)


@for_each(
    ("number", "error", "message"),
    [
        ("many", ValueError, "num_strokes must be a count of 1 or more, a share such as 10%, all, auto"),
        ("0", ValueError, "num_strokes must be a count of 1 or more"),
        ("0%", ValueError, "num_strokes must be above 0 % and at most 100 %, got '0%'"),
        ("200dB", ValueError, "num_strokes must be above 0 dB and at most 100 dB, got 200 dB"),
        (0, ValueError, "num_strokes must be >= 1, got 0"),
        (7000.0, ValueError, "num_strokes must be a whole number, or a share in (0, 1], got 7000.0"),
        (None, TypeError, "num_strokes must be a number, a share or text, got NoneType"),
        ("90dB", ValueError, "reach"),
    ],
)
def test_numbers_that_are_none_are_refused(number, error, message):
    with pytest.raises(error, match=re.escape(message)):
        bg.cluster(PEARS, number, camera=VIEW, texture="flat")
