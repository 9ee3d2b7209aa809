"""Numbers of strokes as the command line takes them: counts, shares and targets."""

import re

import numpy as np
import pytest

import brushgs as bg
from brushgs.passes.reduce import cluster as passes
from brushgs.still_life import still_life_camera
from tests.scenes import still_life_of

VIEW = still_life_camera(width=120, height=90)


@pytest.fixture(scope="module")
def pears():
    return still_life_of(1000)


def assert_same(one, other):
    for name, column in one.columns().items():
        np.testing.assert_array_equal(column, getattr(other, name))


@pytest.mark.parametrize("number", [200, "200", np.int64(200), "+200"])
def test_a_count_is_that_of_the_pass(pears, number):
    assert_same(bg.cluster(pears, number, seed=3), passes.cluster(pears, 200, seed=3))


@pytest.mark.parametrize("number", [0.1, "10%", "10.0%", np.float32(0.1)])
def test_a_share_is_of_the_gaussians_rounded_up(pears, number):
    assert len(bg.cluster(pears, number)) == np.ceil(0.1 * len(pears) - 1e-3)


def test_all_of_them_are_not_merged(pears):
    assert bg.cluster(pears, "all") is pears
    assert bg.cluster(pears, 1.0) is pears


def test_auto_is_the_number_that_is_chosen_for_a_view(pears):
    chosen = bg.choose_strokes(pears, VIEW, "flat")
    assert_same(bg.cluster(pears, "auto", camera=VIEW, texture="flat"), passes.cluster(pears, chosen.strokes))


def test_auto_without_a_view_is_chosen_for_that_of_a_painting(pears):
    framed = bg.cluster(pears, "auto", camera=bg.frame_scene(pears), texture="flat")
    assert_same(bg.cluster(pears, "auto", texture="flat"), framed)


@pytest.mark.parametrize("sees", [False, True])
def test_a_budget_is_reached_and_a_smaller_one_takes_no_more_strokes(pears, sees):
    views = bg.plain_views(pears, [VIEW]) if sees else None
    plain = bg.render(pears, VIEW, "gaussian").over("white").clip(0, 1)
    counts = []
    for decibels in (16, 18):
        strokes = bg.cluster(pears, f"{decibels}dB", camera=VIEW, texture="flat", views=views)
        painted = bg.render(strokes, VIEW, "flat").over("white").clip(0, 1)
        assert -10 * np.log10(np.mean(np.square(painted - plain, dtype=np.float64))) >= decibels - 1e-3
        counts.append(len(strokes))
    assert counts[0] <= counts[1] < len(pears)


@pytest.mark.parametrize(
    ("number", "error", "message"),
    [
        (
            "many",
            ValueError,
            "cluster: num_strokes must be a count of 1 or more, a share such as 10%, all, auto",
        ),
        ("0", ValueError, "cluster: num_strokes must be a count of 1 or more"),
        ("0%", ValueError, "cluster: num_strokes must be above 0 % and at most 100 %, got '0%'"),
        ("200dB", ValueError, "cluster: num_strokes must be above 0 dB and at most 100 dB, got 200 dB"),
        (0, ValueError, "cluster: num_strokes must be >= 1, got 0"),
        (7000.0, ValueError, "cluster: num_strokes must be a whole number, or a share in (0, 1], got 7000.0"),
        (None, TypeError, "cluster: num_strokes must be a number, a share or text, got NoneType"),
        ("90dB", ValueError, "reach"),
    ],
)
def test_numbers_that_are_none_are_refused(pears, number, error, message):
    with pytest.raises(error, match=re.escape(message)):
        bg.cluster(pears, number, camera=VIEW, texture="flat")
