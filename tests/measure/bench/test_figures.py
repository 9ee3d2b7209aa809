"""Points, fronts, spreads and the line of advice, from planted numbers."""

import csv
import io
import json
import os
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from brushgs.formats.pictures.images import read_image
from brushgs.measure.bench.figures import Bench, Family, Point, Verified, mark_best
from brushgs.measure.bench.plot import COLORS, write_plot
from brushgs.measure.bench.run import OtherLoad, advice, curves_of, doubts_of
from brushgs.measure.bench.table import COLUMNS, print_bench, rows
from brushgs.measure.bench.timing import TimedRun, TimeQuartiles, time_alternately
from brushgs.measure.likeness import Likeness
from brushgs.stroke_count.curve import knee

VERIFIED = Verified("the reference", 1e-7, 0.0, 1e-6)


def spread(seconds):
    return TimeQuartiles(0.99 * seconds, seconds, 1.01 * seconds, 5)


def point(seconds, rmse, *, label="a", strokes=10, **options):
    psnr = -20 * np.log10(rmse) if rmse else None
    error = Likeness(rmse, 2 * rmse, psnr)
    costs = {"frame": spread(seconds), "painting": spread(1 + seconds)}
    options = {"clustering": rmse} | options
    return Point(label, "strokes", float(strokes), error, costs, VERIFIED, strokes, **options)


def family(points):
    return Family("strokes", "number of strokes", "the plain picture", "a frame", mark_best(points))


@given(st.lists(st.tuples(st.integers(1, 9), st.integers(0, 9)), min_size=1, max_size=12))
def test_every_point_off_the_front_is_beaten_by_one_on_it(pairs):
    points = mark_best(point(float(s), e / 10) for s, e in pairs)
    front = [p for p in points if "frame" in p.best_by]
    assert front
    for p in points:
        better = [
            q
            for q in front
            if q.cost.median <= p.cost.median
            and q.error.rmse <= p.error.rmse
            and (q.cost.median, q.error.rmse) != (p.cost.median, p.error.rmse)
        ]
        assert bool(better) != ("frame" in p.best_by)


def timed(q1, median, q3, rmse, label):
    one = point(median, rmse, label=label)
    return replace(one, seconds={"frame": TimeQuartiles(q1, median, q3, 5)})


def test_times_whose_quartiles_overlap_wholly_are_no_difference():
    """Of two that take the same time, as far as is known, the one with more error is on no front."""
    found = mark_best([timed(1.0, 1.1, 1.2, 0.2, "worse"), timed(0.9, 1.15, 1.3, 0.1, "better")])
    assert [p.label for p in found if p.best_by] == ["better"]
    found = mark_best([timed(1.0, 1.1, 1.2, 0.2, "sooner"), timed(1.15, 1.25, 1.3, 0.1, "better")])
    assert [p.label for p in found if p.best_by] == ["sooner", "better"]  # they overlap in part


def test_a_curve_that_rises_at_its_end_and_a_busy_machine_are_told():
    rising = family([point(1, 0.3, strokes=10), point(2, 0.1, strokes=100), point(3, 0.2, strokes=1000)])
    (doubt,) = doubts_of([rising], None)
    assert doubt == "the error rises again beyond 100 strokes, from 25.5 to 51 of 255 with 1,000"
    falling = family([point(1, 0.3, strokes=10), point(2, 0.1, strokes=100)])
    assert doubts_of([falling], 0.02) == ()
    assert "other programs used 0.8 processors" in doubts_of([falling], 0.8)[0]
    shaky = replace(falling, points=mark_best([timed(0.5, 1.0, 1.5, 0.1, "a")]))
    assert doubts_of([shaky], 0.0) == ("times are unsteady: their quartiles lie 100% of the median apart",)


def test_other_programs_are_noticed(tmp_path, monkeypatch):
    """Of 100 s on two processors both were busy; this process used 60 s of the 200."""
    stat, used = tmp_path / "stat", [0.0, 0.0]
    monkeypatch.setattr("brushgs.measure.bench.run.STAT", stat)
    monkeypatch.setattr(
        "brushgs.measure.bench.run.os.times",
        lambda: SimpleNamespace(user=used[0], system=0, children_user=0, children_system=0, elapsed=used[1]),
    )
    per_second = os.sysconf("SC_CLK_TCK")
    stat.write_text("cpu  1000 0 0 500 0 0 0 0 0 0\n")
    load = OtherLoad()
    stat.write_text(f"cpu  {1000 + 200 * per_second} 0 0 500 0 0 0 0 0 0\n")
    used[:] = 60.0, 100.0
    assert load.cores() == pytest.approx(1.4)
    stat.unlink()
    assert load.cores() is None


def bench_of(counts=(100, 1000, 10000)):
    points = [point(1e-3 * n**0.5, n**-0.2, label=f"{n:,}", strokes=n, unpainted=0.1) for n in counts]
    curve = family(points)
    return Bench((curve,), *advice(curve))


def test_the_advice_is_that_of_the_knee():
    result = bench_of((125, 250, 500, 1000, 2000, 4000, 8000))
    curves = curves_of(result["strokes"])
    assert result.knees == {kind: knee(curve) for kind, curve in curves.items()}
    for kind, who in (("frame", "a film"), ("painting", "a still")):
        bend = result.knees[kind]
        words = result.advice.split(f"{who} is worth ")[1].split(")")[0]
        assert int(words.split()[0].replace(",", "")) == pytest.approx(bend.strokes, rel=0.05)
        assert f"({bend.psnr:.1f} dB" in words or kind == "painting"
        if bend.strokes < 8000:
            assert f"doubling buys {bend.gain_of_doubling:.1f} dB for {bend.cost_of_doubling:.1f} x" in words


def test_what_has_no_knee_has_no_advice_and_more_strokes_may_bring_nothing(capsys):
    flat = family([point(1e-3 * n, 0.2, strokes=n) for n in (10, 100, 1000, 10000)])
    assert "doubling buys nothing" in advice(flat)[1]
    result = bench_of((100, 1000))
    assert (result.knees, result.advice, result.as_dict()["knees"]) == ({}, None, {})
    print_bench(result, Console(width=200))
    assert capsys.readouterr().out.rstrip().endswith("both more accurate and faster")  # no line of advice
    equal = family([point(1, 0.1, strokes=n) for n in (10, 10, 20)])  # two counts came to the same strokes
    assert curves_of(equal) == {}


def test_csv_and_json_say_the_same():
    result = bench_of()
    written = list(csv.DictReader(io.StringIO(result.as_csv())))
    points = json.loads(json.dumps(result.as_dict()))["families"][0]["points"]
    assert len(written) == len(points) == 3
    for row, found in zip(written, points, strict=True):
        assert (row["family"], row["label"]) == ("strokes", found["label"])
        for kind in ("frame", "painting"):
            for name in ("q1", "median", "q3", "runs"):
                assert float(row[f"{kind}_{name}"]) == found["seconds"][kind][name]
            assert bool(int(row[f"{kind}_is_best"])) is (kind in found["best_by"])
        for name in ("rmse", "psnr"):
            assert float(row[name]) == found["error"][name]
        for name in ("unpainted", "clustering"):
            assert float(row[name]) == found[name]
        assert row["ssim"] == row["flip"] == ""  # not measured is empty, not zero
        assert float(row["verified_mean"]) == found["verified"]["mean"]
    exact = Bench((family([point(1, 0.0)]),), {}, None)
    assert "Infinity" not in json.dumps(exact.as_dict())
    assert rows(exact["strokes"])[0][COLUMNS.index("PSNR")] == "equal"


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


@pytest.mark.filterwarnings("ignore:Creating legend")  # takes long where others work too
@pytest.mark.parametrize("count", [1, 4])
def test_a_plot_of_any_number_of_families_is_whole_and_light(tmp_path, count):
    result = bench_of((125, 250, 500, 1000))
    path = tmp_path / "plot.png"
    write_plot(Bench(result.families * count, result.knees, result.advice), path, "title")
    picture = read_image(path)
    columns = min(2 * count, 3)  # a panel for each time
    assert picture.shape[:2] == (int(110 * (2.7 * -(-2 * count // 3) + 0.3)), int(110 * 3.4 * columns))
    for column in range(columns):  # something is drawn in each panel
        panel = picture[40:300, 374 * column : 374 * (column + 1), :3]
        assert (panel.min(axis=2) < 0.4).sum() > 500
    assert path.stat().st_size < 60_000


def test_a_plot_keeps_the_colors_of_its_series_and_has_a_place_for_errors_of_zero(tmp_path):
    """Few colors are written: each of these must be among them."""
    points = [point(1 + i, 0.1 * i, strokes=1 + i, clustering=None) for i in range(4)]
    points = [replace(one, series=f"series {i}") for i, one in enumerate(points)]
    write_plot(Bench((family(points),), {}, None), tmp_path / "plot.png", "title")
    picture = np.rint(255 * read_image(tmp_path / "plot.png")[..., :3]).reshape(-1, 3)
    assert {tuple(bytes.fromhex(color[1:])) for color in COLORS} <= {tuple(color) for color in picture}
