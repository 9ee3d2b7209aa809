import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from brushgs.stroke_count.curve import STEPS, ErrorCurve, Knee, fitted_rmse, fitted_seconds, knee
from tests.kit.for_each import for_each

COUNTS = np.array([125 * 2**step for step in range(9)] + [100_000])


def curve_of(strokes=COUNTS, *, slope=0.5, fixed=0.002, per_stroke=1e-7, floor=0.0, factor=1.0):
    k = np.asarray(strokes, float)
    return ErrorCurve(k, factor * (k**-slope + floor), fixed + per_stroke * k)


def exact_knee(curve, slope):
    """Where the error k^-slope falls as steeply as the chord, for seconds linear in k."""
    first, last = curve.strokes[[0, -1]].astype(float)
    chord = (first**-slope - last**-slope) / (last - first)
    return (chord / slope) ** (-1 / (slope + 1))


@for_each("slope", [0.25, 0.5])
def test_the_knee_of_a_power_and_a_line_is_where_they_are_parallel_to_the_chord(slope):
    curve = curve_of(slope=slope)
    bend = knee(curve)
    assert bend.strokes == pytest.approx(exact_knee(curve, slope), rel=0.06)  # worst seen: 4.7 %
    assert bend.psnr == pytest.approx(20 * slope * np.log10(bend.strokes), abs=0.2)
    assert bend.gain_of_doubling == pytest.approx(20 * slope * np.log10(2), abs=0.15)
    seconds = 0.002 + 1e-7 * np.array([bend.strokes, 2 * bend.strokes])
    assert bend.cost_of_doubling == pytest.approx(seconds[1] / seconds[0], rel=0.02)


def test_units_and_a_fixed_time_do_not_move_the_knee():
    expected = knee(curve_of()).strokes
    assert knee(curve_of(factor=0.01)).strokes == expected
    slow = curve_of()
    slow = ErrorCurve(slow.strokes, slow.rmse, 37 * slow.seconds)
    assert knee(slow).strokes == expected
    assert knee(curve_of(fixed=0.02)).strokes == pytest.approx(expected, rel=0.1)


@given(
    st.lists(st.floats(0, 1), min_size=1, max_size=10),
    st.lists(st.floats(1e-6, 1e3), min_size=10, max_size=10),
)
@settings(max_examples=25, deadline=None)
def test_any_curve_has_a_knee_within_its_counts_and_monotone_fits(errors, seconds):
    strokes = 1 + 7 * np.arange(len(errors)) ** 3
    curve = ErrorCurve(strokes, errors, seconds[: len(errors)])
    bend = knee(curve)
    assert strokes[0] <= bend.strokes <= strokes[-1]
    assert np.isfinite([bend.psnr, bend.gain_of_doubling, bend.cost_of_doubling]).all()
    assert bend.gain_of_doubling >= -1e-9
    assert bend.cost_of_doubling >= 1 - 1e-9
    at = np.geomspace(strokes[0], strokes[-1], STEPS)
    assert (np.diff(fitted_rmse(curve, at)) <= 1e-12).all()
    assert (np.diff(fitted_seconds(curve, at)) >= -1e-9 * max(seconds)).all()


def test_where_nothing_is_gained_the_knee_is_the_first_count_and_where_nothing_costs_the_last():
    strokes = [100, 200, 400]
    assert knee(ErrorCurve(strokes, [0.1, 0.1, 0.1], [1.0, 2.0, 4.0])).strokes == 100
    last = knee(ErrorCurve(strokes, [0.4, 0.2, 0.1], [1.0, 1.0, 1.0]))
    assert last.strokes == 400
    assert last.gain_of_doubling == pytest.approx(20 * np.log10(2), abs=1)  # the last octave; fitted: 6.8


def test_a_last_count_that_merges_nothing_is_an_end_and_no_part_of_the_fit():
    counts = np.array([100, 400, 1600, 6400, 8000])
    errors, seconds = np.append(0.3 * (counts[:-1] / 100.0) ** -0.5, 0.0), [1.0, 1.1, 1.5, 3.1, 2.0]
    bend = knee(ErrorCurve(counts, errors, seconds, ends_unmerged=True))
    assert 300 < bend.strokes < 1600
    assert knee(ErrorCurve(counts, errors, [*seconds[:-1], 0.9], True)).strokes == 8000  # the first is slower
    flat = [0.3, 0.299, 0.298, 0.297, 0.0]  # merged ones are all as bad
    assert knee(ErrorCurve(counts, flat, seconds, True)) == Knee(8000, 240.0, 0.0, 1.0)
    assert knee(ErrorCurve([5], [0.1], [1.0], True)).strokes == 5


@for_each(
    ("strokes", "rmse", "seconds", "words"),
    [
        ([2, 1], [0.1, 0.2], [1, 2], "strokes must ascend"),
        ([0, 1], [0.1, 0.2], [1, 2], "strokes must ascend from 1"),
        ([], [], [], "strokes must ascend"),
        ([1, 2], [0.1, np.nan], [1, 2], "rmse must be finite"),
        ([1, 2], [0.1, -1], [1, 2], "rmse must be finite and >= 0"),
        ([1, 2], [0.1, 0.1], [0, 2], "seconds must be finite and > 0"),
        ([1, 2], [0.1], [1, 2], "must have shape"),
    ],
)
def test_what_is_no_curve_is_refused(strokes, rmse, seconds, words):
    with pytest.raises(ValueError, match=words):
        ErrorCurve(strokes, rmse, seconds)
