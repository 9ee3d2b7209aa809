"""Strokes that see, on trained scenes, as the command makes them: nearer to the scene, and steadier."""

import pytest

from brushgs.measure.stability import report_stability
from brushgs.options.experiments import StabilityConfig
from brushgs.options.sequence import PathConfig
from examples.benchmarks.strokes import COUNTS, Scene, measure
from tests.kit import real_scene, without_look

SIZE = 400, 300


@pytest.fixture(autouse=True)
def benchmark_is_small(monkeypatch):
    """Pictures near the first view have half the sides, and none is drawn again to be timed."""
    monkeypatch.setattr("examples.benchmarks.strokes.SIZE", SIZE)
    monkeypatch.setattr("examples.benchmarks.strokes.FRAMES", 1)


# dB at 0 degrees and on the ring. Truck, skull and a face gain more, see examples/measured/strokes.md.
def test_strokes_that_see_are_nearer_to_the_scene_also_where_nothing_looked():
    real_scene("koala.ply")
    scene = Scene("koala.ply", (COUNTS[1],))
    off, on = sorted(measure(scene, ["off", "on"], 1, ["flat"]), key=lambda row: row.arm)
    assert on.made <= COUNTS[1]
    assert on.psnr[0] > off.psnr[0] + 0.8
    assert on.ring_psnr > off.ring_psnr + 0.7
    assert on.unpainted < off.unpainted + 0.005


# RMSE of 255: a third of that of a painterly filter on each frame alone.
def test_along_an_orbit_strokes_that_see_hold_still(tmp_path):
    paint = without_look("dry_brush", 2000, (320, 180), view={"up": (0, -1, 0)})
    config = StabilityConfig(gaps=(1,), pairs=6, alone=0)
    path = PathConfig(orbit=240)
    report = report_stability(real_scene("koala.ply"), tmp_path / "a.json", paint, path, config)
    tracked = report.result["track"]
    assert (tracked.events.flips, tracked.events.spins) == (0, 0)
    assert tracked.events.pop_share < 1e-4  # on truck, whose path goes among the strokes, 4 of 480,000 grow
    assert 255 * tracked.warps[0].excess < 2.0
