"""Spheres and stereo pictures from scene files: cameras, notes, films."""

import numpy as np
import OpenImageIO
import pytest

import brushgs as bg
from brushgs.cameras.framing import plain_first_view
from brushgs.options.painting import PaintConfig, ViewConfig
from brushgs.options.projection import ProjectionConfig
from brushgs.options.sequence import PathConfig, SequenceConfig
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.rigs import leveled, open_rig
from brushgs.pipeline.sequence import paint_sequence
from brushgs.pipeline.still import paint_file
from tests.kit import BLIND, changed, stages, still_life_of
from tests.passes.scenes import gaussians_at

SPHERE = ProjectionConfig(projection="equirect")


def test_a_sphere_stands_where_the_camera_was_and_is_level():
    up = np.array([0.0, -0.6, 0.8])
    for target in ((0, 0, 0), (1, -3, 2), (1, 1, -4)):
        camera = bg.Camera.look_at((1, -2, -4), target, up, width=64, height=32, near=0.02)
        level = leveled(camera, up)
        np.testing.assert_allclose(level.position, camera.position, atol=1e-12)
        np.testing.assert_allclose(-level.viewmat[1, :3], up, atol=1e-12)
        assert level.viewmat[2, :3] @ camera.viewmat[2, :3] > 0
        assert (level.width, level.height, level.near) == (64, 32, 0.02)
    # One that looks straight down has ahead what was above.
    down = bg.Camera.look_at((0, -2, 0), (0, 0, 0), (0, 0, 1), width=64, height=32)
    level = leveled(down, np.array([0.0, -1.0, 0.0]))
    np.testing.assert_allclose(level.viewmat[2, :3], (0, 0, 1), atol=1e-12)


def test_a_subject_fills_some_90_degrees_of_a_sphere():
    directions = np.random.default_rng(0).normal(size=(400, 3))
    means = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    ball = gaussians_at(means, 0.1, opacity=1, dtype=np.float32)
    sized = {"size": (64, 32), "up": (0, -1, 0)}
    config = changed(PaintConfig(), cluster={"strokes": 60}, view=sized, projection=SPHERE)
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


FEW = changed(PaintConfig(), cluster={"strokes": 150}, strokes=BLIND)


def test_a_sphere_is_painted_to_a_file_with_layers(scene, folder):
    layers = {"layers": ("depth", "normal", "unlit")}
    config = changed(FEW, view={"size": (64, 32)}, projection=SPHERE, output=layers)
    paint_file(scene, "a.exr", config)
    spec = OpenImageIO.ImageInput.open("a.exr").spec()
    assert (spec.width, spec.height) == (64, 32)
    assert spec.get_string_attribute("textureformat") == "LatLong Environment"
    assert {"Z", "N.X", "unlit.R", "paint.A"} <= set(spec.channelnames)
    assert spec.getattribute("worldToCamera") is None  # there is no single view


def test_frames_of_a_sphere_do_not_depend_on_processes_and_are_resumed(scene, folder):
    config = changed(FEW, view={"size": (48, 24)}, projection=SPHERE)
    path, files = PathConfig(orbit=3), {}
    for name, jobs in (("alone", 1), ("parted", 2)):
        report = paint_sequence(scene, f"{name}/", path, config, SequenceConfig(jobs=jobs))
        files[name] = [path.read_bytes() for path in sorted(folder.glob(f"{name}/*.png"))]
    assert files["alone"] == files["parted"]
    track = stages(report)["track"]  # nothing is
    assert (track.did, track.counts["strokes"]) == ("nothing", 0)
    assert track.skipped == ["tracking: the lock is 'canonical'"]
    (folder / "parted/00001.png").unlink()
    paint_sequence(scene, "parted/", path, config, SequenceConfig(is_resumed=True))
    assert (folder / "parted/00001.png").read_bytes() == files["alone"][1]
    other = changed(FEW, view={"size": (48, 48)}, projection=ProjectionConfig(stereo="vr180"))
    with pytest.raises(bg.SceneError, match="another painting"):
        paint_sequence(scene, "parted/", path, other, SequenceConfig(is_resumed=True))


@pytest.mark.filterwarnings("ignore")
def test_a_film_of_two_eyes_is_tracked_once_for_both(scene, folder):
    config = changed(FEW, view={"size": (48, 32)}, projection=ProjectionConfig(stereo="side"))
    found = stages(paint_sequence(scene, "a.mp4", PathConfig(orbit=3), config))
    assert found["track"].counts["lock"] == "track"
    assert found["track"].counts["strokes"] > 0
    assert found["write"].counts["width"] == 96
    assert b"st3d" in (folder / "a.mp4").read_bytes()
