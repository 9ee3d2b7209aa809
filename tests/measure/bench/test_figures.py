"""Points, fronts, spreads and the line of advice, from planted numbers."""

import csv
import io
import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brushgs.io.pictures.images import read_image
from brushgs.measure.bench.advice import advice, curves_of
from brushgs.measure.bench.figures import Bench, Family, Point, Verified, mark_best
from brushgs.measure.bench.plot import COLORS, write_plot
from brushgs.measure.bench.table import rows
from brushgs.measure.bench.timing import TimedRun, TimeQuartiles, time_alternately
from brushgs.measure.likeness import Likeness
from brushgs.stroke_count.curve import knee

VERIFIED = Verified("the reference", 1e-7, 0.0, 1e-6)


def spread(seconds):
    return TimeQuartiles(0.9 * seconds, seconds, 1.1 * seconds, 5)


def point(seconds, rmse, *, label="a", strokes=10, **options):
    psnr = -20 * np.log10(rmse) if rmse else None
    error = Likeness(rmse, 2 * rmse, psnr)
    costs = {"frame": spread(seconds), "painting": spread(1 + seconds)}
    return Point(label, "strokes", float(strokes), error, costs, VERIFIED, strokes, **options)


def family(points):
    return Family("strokes", "number of strokes", "the plain picture", "a frame", mark_best(points))


def test_the_front_holds_what_nothing_beats_in_both():
    planted = [(1, 9), (2, 5), (3, 6), (4, 5), (5, 1), (2, 5), (0.5, 10), (6, 2)]
    found = family([point(s, e / 10, label=str(i)) for i, (s, e) in enumerate(planted)])
    assert [p.label for p in found.points if p.is_best] == ["0", "1", "4", "5", "6"]
    assert [p.label for p in found.best] == ["6", "0", "1", "5", "4"]  # cheapest first; equal ones both stay


@given(st.lists(st.tuples(st.integers(1, 9), st.integers(0, 9)), min_size=1, max_size=12))
def test_every_point_off_the_front_is_beaten_by_one_on_it(pairs):
    points = mark_best(point(float(s), e / 10) for s, e in pairs)
    front = [p for p in points if p.is_best]
    assert front
    for p in points:
        better = [
            q
            for q in front
            if q.cost.median <= p.cost.median
            and q.error.rmse <= p.error.rmse
            and (q.cost.median, q.error.rmse) != (p.cost.median, p.error.rmse)
        ]
        assert bool(better) != p.is_best


def bench_of(counts=(100, 1000, 10000)):
    points = [point(1e-3 * n**0.5, n**-0.2, label=f"{n:,}", strokes=n, unpainted=0.1) for n in counts]
    curve = family(points)
    return Bench((curve,), *advice(curves_of(curve)))


def test_the_advice_is_that_of_the_knee():
    result = bench_of((125, 250, 500, 1000, 2000, 4000, 8000))
    bend = knee(curves_of(result["strokes"])["frame"])
    assert result.knee == bend
    assert (
        f"strokes reach {bend.psnr:.1f} dB; doubling them buys {bend.gain_of_doubling:.1f} dB"
        in result.advice
    )
    assert f"for {bend.cost_of_doubling:.1f} x the time of a frame" in result.advice
    said = int(result.advice.removeprefix("for this scene ").split()[0].replace(",", ""))
    assert said == pytest.approx(bend.strokes, rel=0.05)


def test_more_strokes_that_bring_nothing_are_said_to():
    flat = family([point(1e-3 * n, 0.2, strokes=n) for n in (10, 100, 1000, 10000)])
    assert "doubling them buys nothing" in advice(curves_of(flat))[1]


def test_two_points_have_no_knee_and_no_advice():
    result = bench_of((100, 1000))
    assert (result.knee, result.advice) == (None, None)
    assert result.as_dict()["knee"] is None
    equal = family([point(1, 0.1, strokes=n) for n in (10, 10, 20)])  # two counts came to the same strokes
    assert curves_of(equal) == {}


def test_csv_and_json_say_the_same():
    result = bench_of()
    written = list(csv.DictReader(io.StringIO(result.as_csv())))
    points = json.loads(json.dumps(result.as_dict()))["families"][0]["points"]
    assert len(written) == len(points) == 3
    for row, found in zip(written, points, strict=True):
        assert (row["family"], row["label"]) == ("strokes", found["label"])
        assert float(row["frame_median"]) == found["seconds"]["frame"]["median"]
        assert float(row["painting_q3"]) == found["seconds"]["painting"]["q3"]
        assert int(row["frame_runs"]) == found["seconds"]["frame"]["runs"]
        assert float(row["rmse"]) == found["error"]["rmse"]
        assert float(row["psnr"]) == found["error"]["psnr"]
        assert row["ssim"] == row["flip"] == ""  # not measured is empty, not zero
        assert float(row["unpainted"]) == found["unpainted"]
        assert bool(int(row["is_best"])) is found["is_best"]
        assert float(row["verified_mean"]) == found["verified"]["mean"]


def test_equal_pictures_are_told_as_such_not_as_infinity():
    exact = Bench((family([point(1, 0.0)]),), None, None)
    assert "Infinity" not in json.dumps(exact.as_dict())
    assert rows(exact["strokes"])[0][4] == "equal"


def test_a_spread_is_median_and_quartiles():
    assert TimeQuartiles.of([5.0, 1.0, 3.0, 2.0, 4.0]) == TimeQuartiles(2.0, 3.0, 4.0, 5)
    assert TimeQuartiles.of([2.0]) == TimeQuartiles(2.0, 2.0, 2.0, 1)


@pytest.fixture
def clock(monkeypatch):
    """A clock that moves only when a run says so."""
    now = [0.0]
    monkeypatch.setattr("brushgs.measure.bench.timing.time.perf_counter", lambda: now[0])
    return now


def test_runs_take_turns_and_shared_ones_run_once_a_round(clock):
    log = []

    def run(name, seconds):
        def work():
            log.append(name)
            clock[0] += seconds
            return name

        return TimedRun(work, lambda result: log.append(result.upper()))

    slow, quick, middle = run("slow", 3.0), run("quick", 0.01), run("middle", 0.5)
    advances = []
    seconds = time_alternately([slow, quick, middle, quick], 5, lambda: advances.append(1))
    assert [len(seconds[r]) for r in (slow, quick, middle)] == [3, 15, 5]
    assert log[:6] == ["slow", "SLOW", "quick", "QUICK", "middle", "MIDDLE"]  # each is checked
    assert log[6:10] == ["quick", "QUICK"] * 2
    assert seconds[middle] == pytest.approx([0.5] * 5)
    assert len(advances) == 15  # one per run and round


@pytest.mark.parametrize("count", [1, 3, 4])
def test_a_plot_of_any_number_of_families_is_whole_and_light(tmp_path, count):
    result = bench_of((125, 250, 500, 1000))
    path = tmp_path / "plot.png"
    write_plot(Bench(result.families * count, result.knee, result.advice), path, "title")
    picture = read_image(path)
    columns = min(count, 3)
    assert picture.shape[:2] == (int(110 * (2.7 * -(-count // 3) + 0.3)), int(110 * 3.4 * columns))
    for column in range(columns):  # something is drawn in each panel
        panel = picture[40:300, 374 * column : 374 * (column + 1), :3]
        assert (panel.min(axis=2) < 0.4).sum() > 500
    assert path.stat().st_size < 60_000


def test_a_plot_keeps_the_colours_of_its_series(tmp_path):
    """Few colours are written: each of these must be among them."""
    points = [replace(point(1 + i, 0.1, strokes=1 + i), series=f"series {i}") for i in range(4)]
    write_plot(Bench((family(points),), None, None), tmp_path / "plot.png", "title")
    seen = {
        tuple(color) for color in np.rint(255 * read_image(tmp_path / "plot.png")[..., :3]).reshape(-1, 3)
    }
    for color in COLORS:
        assert tuple(bytes.fromhex(color[1:])) in seen


def test_errors_of_zero_have_a_place_on_a_logarithmic_plot(tmp_path):
    exact = Bench((family([point(1, 0.0), point(2, 0.1), point(3, 0.001)]),), None, None)
    write_plot(exact, tmp_path / "plot.png", "title")
    write_plot(Bench((family([point(1, 0.0)]),), None, None), tmp_path / "plot.png", "title")
    assert read_image(tmp_path / "plot.png").min() < 0.5
