"""The temporal report of scenes that move."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.measure.stability import Comparison, measure_stability, report_stability
from brushgs.measure.stability.painters import AlonePainter, nearest_pairs
from brushgs.measure.stability.table import stability_table
from brushgs.options.clip import ClipConfig
from brushgs.options.experiments import StabilityConfig
from brushgs.options.moment import Moment
from brushgs.pipeline.clip import Clip
from brushgs.pipeline.moving import Moving
from brushgs.rendering.motion import StrokeMotion, new_table
from brushgs.rendering.options import RenderOptions
from brushgs.still_life import still_life_camera
from brushgs.still_life.moving import still_life_moving
from brushgs.values.moving import MovingScene
from examples.benchmarks.painterly import painterly_painters
from tests.kit.commands import run
from tests.kit.configs import without_look
from tests.scenes import still_life_of

BRUSH = bg.StrokeTexture.open("dry_brush")
WHITE = (1.0, 1.0, 1.0)
PAINT = without_look("dry_brush", 100, (80, 60), view={"up": (0, -1, 0)})
FEW = StabilityConfig(gaps=(1, 3), alone=1)


def clip_of(scene, **options):
    return Clip(scene, ClipConfig(start=Moment(1.2), end=Moment(1.37), **options))


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The report of six frames in which the pear rolls, and the file of its figures."""
    path = tmp_path_factory.mktemp("moving") / "a.json"
    scene = still_life_moving(1500)
    report_stability(clip_of(scene), path, PAINT, None, FEW, make_extra_painters=painterly_painters)
    return json.loads(path.read_text())


def test_strokes_that_follow_are_steadier_than_frames_painted_alone(written):
    found = {figures["name"]: figures for figures in written["stability"]["configurations"]}
    assert [*found] == ["track", "anchor", "off", "alone", "image", "plain"]
    assert (written["stability"]["frames"], written["stability"]["closed"]) == (6, False)
    assert written["settings"]["clip"]["start"] == {"amount": 1.2, "is_share": False, "is_all": False}
    for name, figures in found.items():
        assert [(warp["gap"], warp["pairs"]) for warp in figures["warps"]] == [(1, 5), (3, 3)]
        assert (figures["animation"] is None) == (name == "plain")
        assert (figures["events"] is None) == (name in ("image", "plain"))
        assert figures["alone_equal"] == figures["alone"] == 1
        assert figures["uiqm"] > 0
        assert 0 < figures["ssim"] <= 1
    assert found["plain"]["ssim"] == pytest.approx(1)
    track, alone, image = (found[name] for name in ("track", "alone", "image"))
    assert track["warps"][0]["excess"] < 0.25 * alone["warps"][0]["excess"]
    assert (track["events"]["flips"], track["events"]["spins"]) == (0, 0)
    assert alone["events"]["flips"] > 0
    for name in ("births", "deaths"):
        assert track["animation"][name] < 0.01 * alone["animation"][name]
    assert track["animation"]["slip_pixels"] < 0.2 * alone["animation"]["slip_pixels"]
    assert track["animation"]["slip_pixels"] < 0.5 * image["animation"]["slip_pixels"]


def test_rows_that_do_not_correspond_are_followed_by_a_truth_or_an_estimate(tmp_path):
    loose = Clip(still_life_moving(2000, has_rows=False), ClipConfig(start=Moment(1.2), end=Moment(1.27)))
    config = StabilityConfig(gaps=(1,), alone=1, skip_alone=True)
    truth = still_life_moving(2000)
    estimated = report_stability(loose, tmp_path / "b.json", PAINT, None, config)
    assert any("is estimated" in detail for detail in estimated.stages[-2].details)
    without_moments = clip_of(MovingScene(4.0, False, loose.scene.sample))
    with pytest.raises(ValueError, match="has no moments from which the flow"):
        report_stability(without_moments, tmp_path / "a.json", PAINT, None)
    report = report_stability(loose, tmp_path / "a.json", PAINT, None, config, truth=truth)
    track = report.result["track"]
    assert track.animation.slip_pixels < 1
    assert track.warps[0].valid_share > 0.2
    by_estimate = estimated.result["track"]
    assert by_estimate.animation.slip_pixels == pytest.approx(track.animation.slip_pixels, abs=0.5)
    assert by_estimate.warps[0].valid_share == pytest.approx(track.warps[0].valid_share, abs=0.1)
    assert by_estimate.warps[0].excess == pytest.approx(track.warps[0].excess, abs=1 / 255)


def resting(num_frames):
    """Strokes of a moving scene in which nothing moves, before a camera that stands still."""
    scene = still_life_of(3000)
    strokes = replace(bg.cluster(bg.prune(scene), 100), ids=None)
    still = MovingScene(1.0, True, lambda time: scene)
    film = Clip(still, ClipConfig(end=Moment((num_frames - 1) / 30))).film()
    motion = StrokeMotion(film.moments, np.empty(0, np.int32), np.empty((0, 3)), new_table(num_frames, 0))
    moving = Moving.of(still, film, motion, takes_light=True)
    cameras = [still_life_camera(width=48, height=36)] * num_frames
    options = RenderOptions.of(BRUSH, order="soft")
    return Comparison(scene, strokes, cameras, BRUSH, options, WHITE, moving=moving, truth=still)


def test_where_nothing_moves_nothing_is_measured():
    found = measure_stability(resting(4), StabilityConfig(alone=0), make_extra_painters=painterly_painters)
    names = [figures.name for figures in found.configurations]
    assert names == ["track", "anchor", "off", "image", "plain"]
    for figures in found.configurations:
        assert figures.warps[0].rmse < 1e-5
    for name in ("track", "image"):
        marks = found[name].animation
        assert marks.slip_pixels < 1e-3
        assert (marks.births, marks.deaths, marks.pops) == (0, 0, 0)
        assert marks.size_drift < 1e-15
    assert stability_table(found).row_count > 20


def test_frames_painted_alone_keep_the_marks_that_could_be_the_same():
    comparison = resting(3)
    few = comparison.strokes.take(np.arange(60))
    made = [comparison.strokes, comparison.strokes.take(np.arange(100)[::-1]), few]
    given = few, comparison.cameras, BRUSH, comparison.options
    painter = AlonePainter("alone", "", *given, make=made.__getitem__)
    first, second, third = (painter.boxes(index) for index in range(3))
    for boxes in (second, third):
        _, i, j = np.intersect1d(first.ids, boxes.ids, return_indices=True)
        assert len(i) > 30
        np.testing.assert_array_equal(first.centers[i], boxes.centers[j])
    assert set(second.ids) == set(first.ids)
    assert set(third.ids) < set(first.ids)


def test_nearest_pairs_are_mutual():
    first = np.array([[0.0, 0, 0], [1, 0, 0], [1.1, 0, 0]])
    second = np.array([[1.02, 0, 0], [9.0, 0, 0]])
    rows, others = nearest_pairs(first, second)
    assert (rows.tolist(), others.tolist()) == ([1], [0])
    assert [len(part) for part in nearest_pairs(first, second[:0])] == [0, 0]


@pytest.mark.usefixtures("folder")
def test_the_command_takes_a_folder_of_moments(capsys):
    scene, folder = still_life_moving(2000), Path("clip")
    folder.mkdir()
    for moment in range(4):
        bg.save(scene.at(1.2 + moment / 30), folder / f"{moment:03}.ply")
    words = ["stability", "clip", "--stroke", "dry_brush", "--strokes", "60", "--size", "48x36"]
    words += ["--skip-alone", "--no-plot", "--moments-per-second", "30"]
    code, _, err = run(capsys, *words)
    assert code == 0, err
    for word in ("flatness", "coherence: slip", "births", "UIQM", "4 frames in 4 configurations"):
        assert word in err
    value = json.loads(Path("clip-stability/stability.json").read_text())
    assert value["settings"]["path"] == {"source": "one view"}
    for more, said in (
        (["--loop", "--cross-fade", "0.03"], "omit --cross-fade"),
        (["--frames", "5"], "a fixed camera does not use it"),
    ):
        code, _, err = run(capsys, *words, *more)
        assert code == 2
        assert said in err
