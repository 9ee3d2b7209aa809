import contextlib
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.cameras.paths import plan_path
from brushgs.formats import read_scene
from brushgs.formats.pictures.images import encode_frame, read_image
from brushgs.formats.pictures.numbered import Manifest
from brushgs.options.painting import StrokesConfig, ViewConfig
from brushgs.options.rules import Rule, Rules
from brushgs.options.sequence import PathConfig, SequenceConfig
from brushgs.options.where import Where, WhereConfig
from brushgs.pipeline.report import Report, pace
from brushgs.pipeline.sequence import paint_sequence
from brushgs.pipeline.sequence_outputs import plan_output
from brushgs.pipeline.views import choose_first_view
from brushgs.values.shot import Shot
from tests.io.test_video import psnr, read
from tests.kit import changed, for_each, names, stages, without_look, write_cameras

NUM_FRAMES = 6
ORBIT = PathConfig(orbit=NUM_FRAMES, fps=12)
VIEW = ViewConfig(size=(48, 36))
OTHERS = {"strokes": 0.5, "seed": 1}
MANIFEST = ".%05d.png.json"
LEFT = Where.parse("half:-1,0,0,0")
FILES = [f"{index:05}.png" for index in range(NUM_FRAMES)]


def config(**draw):
    """Bare clusters, which are made and drawn in few steps; `seen` has all of them."""
    bare = without_look("flat", 150, VIEW.size, strokes=StrokesConfig.off())
    return changed(bare, draw={"underpaint": False, "streaks": 0.0} | draw)


def paint(scene, output="f/", path=ORBIT, paint_config=None, **sequence):
    return paint_sequence(scene, output, path, paint_config or config(), SequenceConfig(**sequence))


def contents(folder):
    return {path.name: path.read_bytes() for path in Path(folder).iterdir() if path.name != MANIFEST}


# ---- frames


@for_each(("suffix", "lock"), [(".png", "track"), (".exr", "track"), (".png", "off")])
def test_a_frame_alone_is_the_frame_of_the_sequence_for_any_number_of_processes(scene, folder, suffix, lock):
    made, name = config(lock=lock), f"{lock}{suffix[1:]}"
    report = paint(scene, f"{name}/%05d{suffix}", paint_config=made)
    assert stages(report)["track"].counts["lock"] == lock
    files = contents(name)
    if suffix == ".png":
        paint(scene, f"{name}2/", paint_config=made, jobs=2)
        assert contents(f"{name}2") == files
    # The same from Python: the strokes, the directions along the closed path, then one frame.
    gaussians = bg.load(scene)
    strokes = bg.cluster(bg.prune(gaussians), 150)
    path = plan_path(choose_first_view(gaussians, VIEW, read_scene(scene)[1], Report()), VIEW, ORBIT)
    frame = next(islice(bg.render_sequence(strokes, path.closed, "flat", lock=lock), 4, None))
    frame = frame if suffix == ".exr" else replace(frame, depth=None)
    known = Shot(path.cameras[4], 4, path.fps)
    assert encode_frame(frame, suffix, (1.0, 1.0, 1.0), shot=known) == files[f"00004{suffix}"]


def views_at(name, places):
    """A file of cameras that look along +z."""
    views = [bg.Camera.look_at(at, np.add(at, (0, 0, 1)), width=20, height=10) for at in places]
    return PathConfig(file=write_cameras(name, views))


def test_a_path_that_sees_nothing_is_refused_unless_one_view_of_many_does(scene, folder):
    places, unsized = [[i, 0, 1000] for i in range(40)], replace(config(), view=ViewConfig())
    with pytest.raises(ValueError, match="in all 40 frames no stroke is in the picture; check that the"):
        paint(scene, "f/", views_at("away.json", places), unsized)
    assert not Path("f").exists()
    places[17] = [0, 0, -9]
    paint(scene, "f/", views_at("once.json", places), unsized)
    assert len(list(Path("f").glob("*.png"))) == 40


def test_frames_of_a_longer_sequence_that_follow_are_told(scene, folder):
    Path("f").mkdir()
    for number in (2, 6, 7):
        Path(f"f/{number:05}.png").write_bytes(b"old")
    with pytest.warns(bg.SceneWarning, match="2 files of an older sequence follow the last frame, from 00"):
        paint(scene)
    assert Path("f/00002.png").read_bytes() != b"old"
    assert Path("f/00007.png").read_bytes() == b"old"


# ---- videos


# Worst frames measured: 32.5, 31.8 and 40.2 dB, for in pictures this small all is edges, which the halved
# chroma of the first two blurs. At 640x480 it is 38.7, 39.0 and 42.3.
@for_each(("name", "least"), [("a.mp4", 31.5), ("a.gif", 39)])
def test_a_video_shows_the_frames(scene, folder, name, least):
    report = paint(scene, name)
    paint(scene, "f/")
    frames, _, rate = read(Path(name))
    assert (len(frames), frames[0].shape) == (NUM_FRAMES, (36, 48, 3))
    assert rate == pytest.approx(12, abs=0.5)  # a GIF rounds to hundredths of a second
    worst = min(psnr(frame, 255 * read_image(f"f/{file}")) for frame, file in zip(frames, FILES, strict=True))
    assert worst > least
    assert report.output == name
    assert stages(report)["write"].counts["bytes"] == Path(name).stat().st_size


def test_odd_sides_of_an_mp4_are_made_even_and_told(scene, folder):
    odd = changed(config(), view={"size": (47, 35)})
    report = paint(scene, "a.mp4", PathConfig(orbit=3), odd)
    assert read(Path("a.mp4"))[0][0].shape == (36, 48, 3)
    assert "48x36: the last row or column is doubled" in stages(report)["write"].did
    assert "doubled" not in stages(paint(scene, "a.webm", PathConfig(orbit=3), odd))["write"].did


# ---- going on


def test_only_what_is_missing_is_painted(scene, folder):
    report = paint(scene, is_resumed=True)  # which begins where there is nothing
    assert stages(report)["paint"].counts["painted"] == NUM_FRAMES
    whole = contents("f")
    stamps = {name: Path("f", name).stat().st_mtime_ns for name in FILES}
    Path("f/00001.png").unlink()
    Path("f/00004.png").write_bytes(whole["00004.png"][:-5])
    report = paint(scene, is_resumed=True)
    assert contents("f") == whole
    assert (stages(report)["paint"].counts["painted"], stages(report)["paint"].counts["skipped"]) == (2, 4)
    assert stages(report)["paint"].skipped == ["4 frames: they exist, whole"]
    kept = [name for name in FILES if Path("f", name).stat().st_mtime_ns == stamps[name]]
    assert kept == [FILES[0], FILES[2], FILES[3], FILES[5]]
    report = paint(scene, is_resumed=True)
    assert stages(report)["paint"].counts["painted"] == 0


@pytest.fixture(scope="module")
def frames_there(scene, tmp_path_factory):
    """A folder in which the frames are painted."""
    folder = tmp_path_factory.mktemp("painted")
    with contextlib.chdir(folder):
        paint(scene)
    return folder


@for_each(
    ("change", "difference"),
    [
        ({"paint_config": config(stroke="ink")}, "stroke flat, now ink"),
        ({"paint_config": changed(config(), light={"relief": 0.5})}, "light plain, now relief 0.5"),
        ({"paint_config": changed(config(), color={"chroma": 1.5})}, "color plain, now chroma 1.5"),
        ({"paint_config": replace(config(), rules=Rules((Rule(LEFT),)))}, ".*rules.*"),
        ({"paint_config": replace(config(), painted=WhereConfig(LEFT))}, "where .*, now half:-1,0,0,0.*"),
        ({"paint_config": config(lock="off")}, "lock track, now off"),
        ({"paint_config": config(order="depth")}, "order soft, now depth"),
        ({"paint_config": config(background="black")}, "background white, now black"),
        ({"paint_config": changed(config(), prune={"keep": 0.5})}, "keep 0.7, now 0.5"),
        ({"paint_config": changed(config(), cluster=OTHERS)}, "strokes 150, now 0.5; seed 0, now 1"),
        ({"paint_config": changed(config(), view={"size": (36, 48)})}, "another path"),
        ({"paint_config": changed(config(), view={"azimuth": 1.0})}, "another path"),
        ({"path": PathConfig(orbit=7)}, "frames 6, now 7; another path"),
    ],
)
def test_another_painting_is_not_gone_on_with(scene, frames_there, monkeypatch, change, difference):
    monkeypatch.chdir(frames_there)
    before = contents("f") | {MANIFEST: Path("f", MANIFEST).read_bytes()}
    sentence = rf"f/%05d\.png: the frames there are of another painting \({difference}\); give the options"
    with pytest.raises(bg.SceneError, match=sentence):
        paint(scene, **change, is_resumed=True)
    assert contents("f") | {MANIFEST: Path("f", MANIFEST).read_bytes()} == before


def test_another_scene_stroke_or_ground_of_the_same_name_is_not_gone_on_with(scene, folder):
    Path("a.ply").write_bytes(Path(scene).read_bytes())
    for name in ("ground.png", "brush.png"):
        bg.save(bg.Frame(np.full((4, 4, 3), 0.2, np.float32), np.full((4, 4), 0.4, np.float32)), name)
    same = config(stroke="brush.png", background="ground.png")
    short = PathConfig(orbit=3)
    paint("a.ply", path=short, paint_config=same)
    paint("a.ply", path=short, paint_config=same, is_resumed=True)
    other = bg.Frame(np.full((3, 9, 3), 0.1, np.float32), np.full((3, 9), 0.9, np.float32))
    others = {"ground.png": "another background image", "brush.png": "another stroke image"}
    for name, difference in (others | {"a.ply": "another scene"}).items():
        content = Path(name).read_bytes()
        bg.save(bg.load(scene).take(slice(0, 1500)) if name == "a.ply" else other, name)
        with pytest.raises(bg.SceneError, match=rf"of another painting \([^)]*{difference}"):
            paint("a.ply", path=short, paint_config=same, is_resumed=True)
        Path(name).write_bytes(content)


def test_frames_without_a_ledger_are_not_gone_on_with(scene, folder):
    paint(scene)
    Path("f", MANIFEST).unlink()
    with pytest.raises(bg.SceneError, match="no such manifest, so it is not known which painting the 6 fr"):
        paint(scene, is_resumed=True)


# ---- outputs


@for_each(
    ("output", "pattern"),
    [
        ("frames/", "frames/%05d.png"),
        ("frames", "frames/%05d.png"),
        ("clip.mp4/", "clip.mp4/%05d.png"),
        ("a/b-%03d.exr", "a/b-%03d.exr"),
        ("%d.TIF", "%d.TIF"),
    ],
)
def test_folders_and_patterns_are_numbered_files(folder, output, pattern):
    assert plan_output(output).pattern == Path(pattern)


CLEAR = {"paint_config": config(background="transparent")}


@for_each(
    ("output", "options", "sentence"),
    [
        ("a.png", {}, r"a path has many frames, but 'a\.png' is one picture; write a-%05d\.png"),
        ("a.avi", {}, r"output of a path must be a folder or end in one of \.mp4, .*\.avif, got 'a\.avi'"),
        ("%d-%d.png", {}, r"must hold one number such as %05d, got '%d-%d\.png'; write %05d\.png"),
        ("file/", {}, r"file/%05d\.png: .*/file is a file, not a folder; choose another name"),
        ("a.gif", {"path": replace(ORBIT, fps=60)}, r"fps must be above 0 and at most 50 for \.gif, got 60"),
        ("a.mp4", {"is_resumed": True}, r"a video cannot be resumed .* numbered frames, -o a/"),
        ("f/", {"paint_config": config(background="redish")}, "background must be white, .* got 'redish'"),
        ("a.mp4", CLEAR, r"not be transparent in a\.mp4, .* choose a color, or write a\.mov or a\.webm"),
        ("f/%05d.jpg", CLEAR, r"in %05d\.jpg, .* no transparency; choose a color, or write %05d\.png"),
    ],
)
def test_an_output_that_cannot_be_is_refused_before_any_work(folder, output, options, sentence):
    Path("file").write_text("old")
    with pytest.raises(ValueError, match=sentence):
        paint("missing.ply", output, **options)
    assert names(folder) == ["file"]


def test_a_painting_that_was_stopped_is_finished_to_the_same_files(scene, folder, monkeypatch):
    paint(scene, "whole/")
    add = Manifest.add

    def stop(self, index, content):
        if index == 3:
            raise KeyboardInterrupt
        add(self, index, content)

    monkeypatch.setattr("brushgs.pipeline.sequence.Manifest.add", stop)
    with pytest.raises(KeyboardInterrupt, match="3 of 6 frames are done; add --resume to paint the rest"):
        paint(scene, "f/")
    assert names("f") == [MANIFEST, *FILES[:3]]
    monkeypatch.undo()
    monkeypatch.chdir(folder)
    report = paint(scene, "f/", is_resumed=True)
    assert stages(report)["paint"].counts["painted"] == 3
    assert contents("f") == contents("whole")


@for_each(
    ("done", "total", "seconds", "text"),
    [
        (0, 5, 3.0, "0/5 frames"),
        (34, 120, 4.0, "34/120 frames, 8.5 per second, 0:10 left"),
        (1, 1000, 10.0, "1/1000 frames, 0.1 per second, 2:46:30 left"),
    ],
)
def test_the_pace_is_told_in_frames_and_minutes(done, total, seconds, text):
    assert pace(done, total, seconds) == text
