"""Strokes are seen by the very cameras of their scene: the first view of a scene travels with its strokes."""

import re
from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.doctor.run import run_doctor
from brushgs.formats import read_scene
from brushgs.formats.scenes.write import write_scene
from brushgs.options.painting import PaintConfig, PaletteConfig, PruneConfig, StrokesConfig, ViewConfig
from brushgs.options.sequence import PathConfig
from brushgs.outlets.passes import cluster_file, prune_file, recolor_file
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.runner import Memory
from brushgs.pipeline.views import choose_first_view
from tests.kit import BLIND, changed, real_scene, save_opaque, still_life_of, without_look

VIEW = ViewConfig(size=(64, 48), azimuth=2.0, elevation=0.7, zoom=1.3)


def cameras_of(path, view, views=None, memory=None):
    off = StrokesConfig.off()
    paint = without_look("gaussian", None, None, prune={"keep": 1.0}, strokes=off, view=view)
    return prepare(path, paint, Report(), views=views, asks=["cameras"], memory=memory).cameras


def assert_same_cameras(one, other, other_memory=None):
    memories = Memory(), other_memory or Memory()  # each file is read and cleaned once
    for view in (ViewConfig(size=(64, 48)), VIEW):
        for path in (None, PathConfig(orbit=3)):
            ours, theirs = (
                [(camera.viewmat.tobytes(), camera.K.tobytes(), camera.near) for camera in cameras]
                for cameras in (
                    cameras_of(file, view, path, memory)
                    for file, memory in zip((one, other), memories, strict=True)
                )
            )
            assert ours == theirs


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "still_life.ply"
    bg.save(still_life_of(1000), path)
    return path


def clustered(path, target, strokes):
    """What a scene is clustered to, by the scene alone: how it is seen is no matter of how strokes see."""
    cluster_file(path, target, changed(PaintConfig(), cluster={"strokes": strokes}, strokes=BLIND), Report())


def test_they_stay_so_from_pass_to_pass(scene, tmp_path):
    steps = [tmp_path / f"{number}.ply" for number in range(4)]
    palette = tmp_path / "palette.png"
    save_opaque(palette, np.random.default_rng(0).random((8, 8, 3)))
    prune_file(scene, steps[0], PruneConfig(keep=0.2), Report())
    cluster_file(steps[0], steps[1], changed(PaintConfig(), cluster={"strokes": 100}), Report())  # that see
    recolor_file(steps[1], steps[2], PaletteConfig(palette), Report())
    run_doctor(steps[2], steps[3], clean="strong")
    memory = Memory()
    for path in steps:
        assert_same_cameras(path, scene, other_memory=memory)
        assert read_scene(path)[1].scene == "still_life"
    assert read_scene(steps[3])[1].is_strokes, "a fixed file of strokes stays one"


def test_strokes_of_a_real_scene_are_framed_as_the_scene(tmp_path):
    path = tmp_path / "scene.ply"
    bg.save(bg.load(real_scene("koala.ply")).take(slice(None, None, 8)), path)
    clustered(path, tmp_path / "strokes.ply", 900)
    assert_same_cameras(tmp_path / "strokes.ply", path)


def test_the_header_of_a_scene_states_up_and_its_strokes_keep_it(scene, tmp_path):
    content = scene.read_bytes().replace(b"element", b"comment up axis: +z\nelement", 1)
    scene.write_bytes(content)
    clustered(scene, tmp_path / "few.ply", 50)
    assert_same_cameras(tmp_path / "few.ply", scene)
    np.testing.assert_array_equal(read_scene(tmp_path / "few.ply")[1].first_view.up, (0, 0, 1))


def test_a_doubt_about_up_is_told_with_its_cure(scene, tmp_path):
    gaussians = bg.load(scene)
    view = choose_first_view(gaussians, ViewConfig(), None, Report())
    ups = (("-y", 0.41), ("+z", 0.38), ("+y", 0.21))
    write_scene(gaussians, tmp_path / "a.ply", first_view=replace(view, probability=0.41, ups=ups))
    notes = read_scene(tmp_path / "a.ply")[1]
    sentence = r"not sure which way is up \(-y 0.41, \+z 0.38\): -y is taken; --up \+z turns it.*views.*"
    sure = replace(notes, first_view=replace(view, probability=0.9, ups=ups))
    told = []
    for file, up in ((notes, None), (notes, "-y"), (sure, None)):
        report = Report()
        choose_first_view(gaussians, ViewConfig(up=up), file, report)
        told.append(report.notes)
    assert re.fullmatch(sentence, told[0][0])
    assert told[1:] == [[], []]
