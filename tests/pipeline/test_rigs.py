"""Spheres and stereo pictures from scene files: cameras, notes, films."""

import warnings

import numpy as np
import OpenImageIO
import pytest

import brushgs as bg
from brushgs.cameras.framing import plain_first_view
from brushgs.cli import main
from brushgs.options.painting import ClusterConfig, PaintConfig, StrokesConfig, ViewConfig
from brushgs.options.projection import ProjectionConfig
from brushgs.options.sequence import PathConfig
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.rigs import leveled, open_rig
from brushgs.pipeline.sequence import paint_sequence
from tests.scenes import save_upright, still_life_of

FEW = ["--strokes", "150", "--see", "off"]


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "still_life.ply"
    save_upright(still_life_of(1000), path)
    return str(path)


def run(*words):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return main([*map(str, words), "--quiet"])


def test_a_sphere_stands_where_the_camera_was_and_is_level():
    up = np.array([0.0, -0.6, 0.8])
    for target in ((0, 0, 0), (1, -3, 2), (1, 1, -4)):
        camera = bg.Camera.look_at((1, -2, -4), target, up, width=64, height=32, near=0.02)
        level = leveled(camera, up)
        np.testing.assert_allclose(level.position, camera.position, atol=1e-12)
        np.testing.assert_allclose(-level.viewmat[1, :3], up, atol=1e-12)
        assert level.viewmat[2, :3] @ camera.viewmat[2, :3] > 0
        assert (level.width, level.height, level.near) == (64, 32, 0.02)


def test_a_subject_fills_some_90_degrees_of_a_sphere():
    directions = np.random.default_rng(0).normal(size=(400, 3))
    means = (directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32)
    count = np.ones(len(means), np.float32)
    ball = bg.Gaussians(
        means,
        np.tile(np.float32([1, 0, 0, 0]), (400, 1)),
        0.1 * np.ones_like(means),
        count,
        np.zeros((400, 1, 3), np.float32),
    )
    view = ViewConfig(size=(64, 32), up=(0, -1, 0))
    config = PaintConfig(
        cluster=ClusterConfig(60), view=view, projection=ProjectionConfig(projection="equirect")
    )
    distance = np.linalg.norm(prepare(ball, config, Report()).camera.position)
    assert 55 < np.degrees(2 * np.arcsin(1 / distance)) < 100


def test_the_eyes_are_a_thirtieth_of_the_distance_apart_and_a_note_says_so():
    gaussians, report = still_life_of(1000), Report()
    view = plain_first_view(gaussians)
    camera = bg.Camera.look_at((0, 0, -30), view.points.mean(axis=0), width=64, height=32)
    notes = []
    report.tell = notes.append
    arguments = (gaussians, camera, view, ViewConfig(), report)
    side = ProjectionConfig(stereo="side")
    rig = open_rig(side, *arguments, is_framed=True)
    assert rig.ipd == pytest.approx(1, rel=0.15)
    assert open_rig(side, *arguments, is_framed=False).ipd == pytest.approx(rig.ipd, rel=0.15)
    assert (
        notes[0] == f"the eyes are {rig.ipd:g} apart, 1/30 of the distance to the subject; --ipd changes it"
    )
    assert open_rig(ProjectionConfig(stereo="side", ipd=0.5), *arguments, is_framed=True).ipd == 0.5
    assert len(notes) == 2


def test_a_sphere_is_painted_to_a_file_with_layers(scene, tmp_path):
    path = tmp_path / "a.exr"
    words = ["--projection", "equirect", "--size", "64x32", "--layers", "depth,normal,unlit"]
    assert run("render", scene, *FEW, *words, "-o", path) == 0
    spec = OpenImageIO.ImageInput.open(str(path)).spec()
    assert (spec.width, spec.height) == (64, 32)
    assert spec.get_string_attribute("textureformat") == "LatLong Environment"
    assert {"Z", "N.X", "unlit.R", "paint.A"} <= set(spec.channelnames)
    assert spec.getattribute("worldToCamera") is None  # there is no single view


def test_frames_of_a_sphere_do_not_depend_on_processes_and_are_resumed(scene, tmp_path, monkeypatch):
    words = ["render", scene, *FEW, "--projection", "equirect", "--size", "48x24", "--orbit", "3"]
    alone, parted = tmp_path / "alone", tmp_path / "parted"
    assert run(*words, "-o", f"{alone}/") == 0
    assert run(*words, "--jobs", "2", "-o", f"{parted}/") == 0
    names = [f"{index:05}.png" for index in range(3)]
    assert all((alone / name).read_bytes() == (parted / name).read_bytes() for name in names)
    (parted / names[1]).unlink()
    assert run(*words, "--resume", "-o", f"{parted}/") == 0
    assert (alone / names[1]).read_bytes() == (parted / names[1]).read_bytes()
    other = [*words[:-4], "--size", "48x48", "--orbit", "3"]
    other[other.index("equirect") - 1 : other.index("equirect") + 1] = ["--stereo", "vr180"]
    assert run(*other, "--resume", "-o", f"{parted}/") == 2  # another painting


def test_nothing_is_tracked_for_a_film_all_around(scene, tmp_path):
    config = PaintConfig(
        cluster=ClusterConfig(strokes=150),
        strokes=StrokesConfig.of(see="off"),
        view=ViewConfig(size=(48, 24)),
        projection=ProjectionConfig(projection="equirect"),
    )
    report = paint_sequence(scene, tmp_path / "a.mp4", PathConfig(orbit=3), config)
    track = next(stage for stage in report.stages if stage.name == "track")
    assert (track.did, track.counts["strokes"]) == ("nothing", 0)
    assert track.skipped == ["tracking: the lock is 'canonical'"]


def test_a_film_of_two_eyes_is_tracked_once_for_both(scene, tmp_path):
    path = tmp_path / "a.mp4"
    config = PaintConfig(
        cluster=ClusterConfig(strokes=150),
        strokes=StrokesConfig.of(see="off"),
        view=ViewConfig(size=(48, 32)),
        projection=ProjectionConfig(stereo="side"),
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        report = paint_sequence(scene, path, PathConfig(orbit=3), config)
    counts = {stage.name: stage.counts for stage in report.stages}
    assert counts["track"]["lock"] == "track"
    assert counts["track"]["strokes"] > 0
    assert counts["write"]["width"] == 96
    assert b"st3d" in path.read_bytes()
