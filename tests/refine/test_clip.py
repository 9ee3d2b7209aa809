"""Strokes of a clip learn from views at several of its moments; how they move stays as it is."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.kit import for_each, names, refused, run, save_opaque, stages_of

torch = pytest.importorskip("torch", reason="needs the extra [refine]")

import brushgs as bg  # noqa: E402
import brushgs.autograd as ba  # noqa: E402
from brushgs import cli  # noqa: E402
from brushgs.cameras.framing import frame_scene  # noqa: E402
from brushgs.options.experiments import RefineConfig  # noqa: E402
from brushgs.options.painting import ClusterConfig, DrawConfig, PaintConfig, ViewConfig  # noqa: E402
from brushgs.pipeline.prepare import STROKES, prepare  # noqa: E402
from brushgs.pipeline.report import Report  # noqa: E402
from brushgs.pipeline.resume import motion_digest  # noqa: E402
from brushgs.refine.distil import distil, mean_psnr  # noqa: E402
from brushgs.refine.fit import Drawing, FitSchedule  # noqa: E402
from brushgs.refine.run import refine_file  # noqa: E402
from brushgs.refine.targets import draw_targets, scene_over_time  # noqa: E402
from brushgs.refine.variables import Variables  # noqa: E402
from brushgs.refine.views import views_over_time  # noqa: E402
from tests.clips import clip_of, moving_scene, save_clip  # noqa: E402
from tests.refine.stops import stopping_after  # noqa: E402

SIZE = {"width": 64, "height": 48}
SMALL = ["--strokes", "60", "--steps", "10", "--views", "8", "--size", "64x48", "--stroke", "flat", "--up=-y"]


@pytest.fixture(scope="module")
def dance(tmp_path_factory):
    return save_clip(tmp_path_factory.mktemp("scene") / "dance")


@pytest.fixture(scope="module")
def prepared(dance):
    """Strokes of the clip and how they move."""
    paint = PaintConfig(cluster=ClusterConfig(60), draw=DrawConfig("flat"), view=ViewConfig(up="-y"))
    return prepare(clip_of(dance), paint, Report(), asks=(*STROKES, "cameras", "first_view", "scene"))


@pytest.fixture(scope="module")
def drawing(prepared):
    return Drawing.of(prepared.texture, prepared.options, prepared.moving.motion)


@pytest.fixture(scope="module")
def views(prepared):
    """Training and validation views."""
    at = scene_over_time(prepared.moving, prepared.whole_scene)
    own = frame_scene(prepared.known_view, **SIZE)
    return [
        draw_targets(views_over_time(prepared.known_view, num, 5, **SIZE, own=camera, shift=shift), at)
        for num, camera, shift in ((12, own, 0.0), (8, None, 0.5))
    ]


def test_a_view_of_a_moment_paints_the_strokes_as_they_are_there(prepared, drawing):
    camera, strokes = frame_scene(prepared.known_view, **SIZE), prepared.strokes
    for moment in range(5):
        moved = prepared.moving.motion.pose(moment).moved(strokes)
        expected = drawing.frame(moved, camera)
        found = drawing.frame(strokes, camera, moment)
        np.testing.assert_array_equal(found.rgb, expected.rgb)
        painted = drawing.tensors(ba.Gaussians.of(strokes), camera, moment)
        np.testing.assert_allclose(painted.rgb, expected.rgb, atol=1e-5)
    first, last = (drawing.frame(strokes, camera, moment).rgb for moment in (0, 4))
    assert np.abs(first - last).max() > 0.2, "the body moves"


def test_strokes_come_nearer_to_the_clip_in_views_they_were_not_fitted_to(prepared, drawing, views):
    before = prepared.strokes, motion_digest(prepared.moving)
    training, validation = views
    assert {view.moment for view in training} == {view.moment for view in validation} == set(range(5))
    start = mean_psnr(prepared.strokes, validation, drawing)
    after, curve = distil(Variables(prepared.strokes, "all"), *views, drawing, FitSchedule(steps=60))
    for moment in range(5):
        here = [view for view in validation if view.moment == moment]
        assert mean_psnr(after, here, drawing) > mean_psnr(prepared.strokes, here, drawing) + 0.3
    assert mean_psnr(after, validation, drawing) > start + 1.0
    assert curve.losses[-1] < 0.9 * curve.losses[1]
    np.testing.assert_array_equal(after.ids, before[0].ids)
    assert motion_digest(prepared.moving) == before[1]


def contents(folder):
    return {path.name: path.read_bytes() for path in Path(folder).iterdir()}


@pytest.fixture(scope="module")
def refined(dance, tmp_path_factory):
    """What one run writes."""
    out = tmp_path_factory.mktemp("refined") / "dance-refined"
    assert cli.main(["refine", str(dance), *SMALL, "-o", f"{out}/", "--quiet"]) == 0
    return out


def test_the_command_writes_a_folder_of_moments_and_tells_the_gain(dance, refined, folder, capsys):
    code, out, err = run(capsys, "refine", dance, *SMALL, "--json", "--report", "report")
    assert (code, err) == (0, "")
    report = json.loads(out)
    assert report["output"] == "dance-refined/"
    stages = {stage["name"]: stage["counts"] for stage in report["stages"]}
    assert stages["refine"]["psnr_after"] > stages["refine"]["psnr_before"]
    assert (stages["views"]["moments"], stages["write"]["moments"]) == (5, 5)
    assert names() == ["dance-refined", "report"]
    assert contents("dance-refined") == contents(refined), "equal input gives equal files"
    assert names("report") == ["refine.json", "refine.png"]
    clip = bg.load_moving("dance-refined")
    assert clip.notes.is_strokes
    assert clip.notes.scene == "dance"
    assert clip.notes.first_view is not None
    assert len(clip.at(0)) == stages["write"]["gaussians"]


def test_a_run_that_was_stopped_resumes_to_the_same_files(dance, refined, folder, monkeypatch, capsys):
    with stopping_after(monkeypatch, 6):
        said = run(capsys, "refine", dance, *SMALL)
    assert said == (130, "", "brushgs: stopped: --resume continues from step 6: dance-refined.checkpoint\n")
    code, out, err = run(capsys, "refine", dance, *SMALL, "--resume")
    assert (code, out) == (0, "dance-refined/\n")
    assert "resumed from step 6" in " ".join(err.split())
    assert contents("dance-refined") == contents(refined)
    assert names() == ["dance-refined"]


@for_each(
    ("words", "sentence"),
    [
        (["-o", "a/%05d.ply"], r"moments are called moment_%05d.ply; name their folder, a/, not"),
        (["-o", "file/"], r"file is a file, not a folder"),
        (["-o", "{dance}/"], r"dance.*: is an input, and .*dance/ would replace it; choose another folder"),
        (["--start", "9"], r"start must be in the 0.208333 s of .*dance, got 9 s"),
    ],
)
def test_a_bad_flag_gets_one_sentence(dance, folder, capsys, words, sentence):
    Path("file").write_text("mine")
    before = contents(dance)
    err = refused(capsys, "refine", dance, *SMALL, *(word.format(dance=dance) for word in words))
    assert re.search(sentence, err), err
    assert names() == ["file"]
    assert contents(dance) == before


def test_strokes_that_are_born_later_learn_too(tmp_path, monkeypatch):
    """Rows of the frames are in any order, and a second body comes later than a stroke takes to come."""
    scene, g = moving_scene(11 / 24), np.random.default_rng(7)
    (tmp_path / "mixed").mkdir()
    for index in range(12):
        moment = scene.at(index / 24)
        late = moment.take(np.arange(220, 340))
        late = replace(late, means=late.means + np.float32([-0.6, -0.9, 0]), sh=-late.sh)
        both = bg.Gaussians.joined([moment, late]) if index > 9 else moment
        bg.save(both.take(g.permutation(len(both))), tmp_path / "mixed" / f"frame_{index}.ply")
    clip = clip_of(tmp_path / "mixed")
    assert not clip.scene.has_rows
    paint = PaintConfig(cluster=ClusterConfig(60), draw=DrawConfig("flat"), view=ViewConfig(up="-y"))
    caught = []

    def watch(*args, **options):
        caught.append(prepare(*args, **options))
        return caught[-1]

    monkeypatch.setattr("brushgs.refine.run.prepare", watch)
    report = refine_file(clip, f"{tmp_path}/out/", paint, RefineConfig(steps=30, views=12, size=(64, 48)))
    counts = {stage.name: stage.counts for stage in report.stages}
    assert counts["follow"]["born"] > 0
    assert counts["refine"]["psnr_after"] > counts["refine"]["psnr_before"] + 0.3
    after, made = bg.load_moving(tmp_path / "out"), caught[0]
    first, last = (made.moving.motion.pose(moment).moved(made.strokes).opacities for moment in (0, 11))
    comes = (first == 0) & (last > 0.3)
    assert comes.sum() > 3
    np.testing.assert_array_equal(after.at(0).opacities[comes], 0)
    assert after.at(11 / 24).opacities[comes].max() > 0.3


def test_a_clip_is_refined_toward_a_style(dance, folder, capsys):
    pytest.importorskip("kornia", reason="needs the extra [refine]")
    g = np.random.default_rng(0)
    stripes = np.where(np.arange(64)[:, None, None] // 4 % 2, (0.1, 0.2, 0.6), (0.9, 0.8, 0.3))
    save_opaque("style.png", (stripes + g.normal(0, 0.02, (64, 80, 3))).clip(0, 1))
    stages = stages_of(capsys, "refine", dance, *SMALL, "--style", "style.png")
    scores = stages["refine"]["counts"]["curve_scores"]
    assert max(scores) > scores[0]
    assert len(list(Path("dance-refined").iterdir())) == 5
