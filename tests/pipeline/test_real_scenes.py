"""Strokes that see, on trained scenes, as the command makes them: nearer to the scene, and steadier."""

from dataclasses import replace

import pytest

from brushgs.measure.stability import report_stability
from brushgs.options.experiments import StabilityConfig
from brushgs.options.painting import ClusterConfig, DrawConfig, PaintConfig, ViewConfig
from brushgs.options.sequence import PathConfig
from examples.benchmarks.strokes import COUNTS, FACE, Scene, measure
from tests.scenes import real_scene

SIZE = 400, 300


@pytest.fixture(autouse=True)
def benchmark_is_small(monkeypatch):
    """Pictures near the first view have half the sides, and none is drawn again to be timed."""
    monkeypatch.setattr("examples.benchmarks.strokes.SIZE", SIZE)
    monkeypatch.setattr("examples.benchmarks.strokes.FRAMES", 1)


def off_and_on(file, count, **view):
    """Two rows of the benchmark, of the flat brush."""
    real_scene(file)
    scene = Scene(file, (count,), **view)
    rows = {row.arm: row for row in measure(scene, ["off", "on"], 1, ["flat"])}
    return rows["off"], rows["on"]


# dB at 0 degrees and on the ring. Truck and skull gain more, see examples/measured/strokes.md.
@pytest.mark.parametrize(
    ("file", "count", "view", "gain", "ring_gain"),
    [
        ("koala.ply", COUNTS[1], {}, 0.8, 0.7),
        ("biker.compressed.ply", 4000, {"view": replace(FACE, size=SIZE)}, 6.6, 0.7),
    ],
    ids=["koala", "face"],
)
def test_strokes_that_see_are_nearer_to_the_scene_also_where_nothing_looked(
    file, count, view, gain, ring_gain
):
    off, on = off_and_on(file, count, **view)
    assert on.made <= count
    assert on.psnr[0] > off.psnr[0] + gain
    assert on.ring_psnr > off.ring_psnr + ring_gain
    assert on.unpainted < off.unpainted + 0.005


# RMSE of 255: a third of that of a painterly filter on each frame alone.
@pytest.mark.parametrize(
    ("file", "size", "pairs", "excess"),
    [
        ("koala.ply", (320, 180), 6, 2.0),
    ],
    ids=["koala"],
)
def test_along_an_orbit_strokes_that_see_hold_still(tmp_path, file, size, pairs, excess):
    paint = PaintConfig(
        cluster=ClusterConfig(2000),
        draw=DrawConfig(stroke="dry_brush"),
        view=ViewConfig(size=size, up=(0, -1, 0)),
    )
    config = StabilityConfig(gaps=(1,), pairs=pairs, alone=0)
    report = report_stability(real_scene(file), tmp_path / "a.json", paint, PathConfig(orbit=240), config)
    tracked = report.result["track"]
    assert (tracked.events.flips, tracked.events.spins) == (0, 0)
    assert tracked.events.pop_share < 1e-4  # on truck, whose path goes among the strokes, 4 of 480,000 grow
    assert 255 * tracked.warps[0].excess < excess
