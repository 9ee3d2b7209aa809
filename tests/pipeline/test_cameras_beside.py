"""Cameras that lie beside a scene: what they give, below what is stated, and the one note that says so."""

import json

import numpy as np
import pytest

import brushgs as bg
from brushgs.cli import main
from brushgs.formats.scenes.read import read_scene
from brushgs.options.painting import ViewConfig
from brushgs.options.scene_source import SceneSource
from brushgs.pipeline.report import Report
from brushgs.pipeline.views import choose_first_view
from brushgs.pipeline.views_sheet import plan_sheet
from tests.first_view.scenes import about, moved, statue
from tests.first_view.test_photographed import moved_cameras, photographs
from tests.kit import for_each, run, save_upright, write_cameras

ON_SIDE = about((1, 0, 0), -90.0)  # of the statue: then +z is up
FEW = slice(None, None, 8)  # of its Gaussians: enough for a view
TAKEN = (
    "up and first view from cameras.json beside the scene (40 cameras); --camera-file none switches it off"
)


@pytest.fixture
def scene(tmp_path):
    """A statue on its side, with its cameras beside it."""
    path = tmp_path / "capture" / "statue.ply"
    write_cameras(path.parent / "cameras.json", moved_cameras(photographs(), rotation=ON_SIDE))
    bg.save(moved(statue().take(FEW), rotation=ON_SIDE), path)
    return path


def view_of(source, config=None):
    """The first view, its stage, and the notes."""
    report = Report()
    gaussians, notes = read_scene(source)
    view = choose_first_view(gaussians, config or ViewConfig(), notes, report)
    return view, report.stages[0], report.notes


@pytest.fixture(scope="module")
def without_cameras(tmp_path_factory):
    """The first view and the notes of the statue on its side where no cameras are sought."""
    path = tmp_path_factory.mktemp("alone") / "statue.ply"
    bg.save(moved(statue().take(FEW), rotation=ON_SIDE), path)
    view, _, notes = view_of(SceneSource((path,), seeks_cameras=False))
    return view, notes


def test_they_give_up_and_the_first_view_and_one_note_says_so(scene):
    view, stage, notes = view_of(scene)
    assert notes == [TAKEN]
    assert np.array_equal(view.up, (0, 0, 1))
    assert stage.did == "up is +z (from cameras.json), seen from outside"
    file = str(scene.parent / "cameras.json")
    assert (stage.counts["up_from"], stage.counts["cameras"]) == ("cameras", file)
    # They may lie in the folder above, too, and a scene may be a folder.
    below = scene.parent / "points" / "a.ply"
    below.parent.mkdir()
    scene.rename(below)
    assert view_of(below)[2] == view_of(below.parent)[2] == [TAKEN]


def test_no_other_place_or_name_is_looked_at(scene):
    folder = scene.parent / "a" / "b"
    (folder / "c").mkdir(parents=True)
    for place in ("../../cameras.json", "c/cameras.json", "transforms_val.json", "sparse/cameras.json"):
        write_cameras(folder / place, moved_cameras(photographs(), rotation=ON_SIDE))
    scene = scene.rename(folder / "statue.ply")
    assert not any("cameras" in note for note in view_of(scene)[2])


def test_flags_and_the_header_come_first(scene):
    _, stage, notes = view_of(scene, ViewConfig(up="+z"))
    assert notes == [TAKEN.replace("up and first", "first")]
    assert stage.counts["up_from"] == "flag"
    both = ViewConfig(azimuth=1.0, elevation=0.2)
    assert view_of(scene, both)[2] == [TAKEN.replace("up and first view", "up")]
    _, stage, notes = view_of(scene, ViewConfig(up="+z", azimuth=1.0, elevation=0.2))
    assert notes == []
    assert "cameras" not in stage.counts
    save_upright(bg.load(scene), scene)
    _, stage, notes = view_of(scene)
    assert notes == [
        "cameras.json lies beside the scene, but its cameras have +z up, and -y is stated: it is not used, "
        "and --camera-file none passes over it"
    ]
    assert (stage.counts["up_from"], stage.counts["cameras"]) == ("header", None)


@for_each(
    ("content", "why"),
    [
        (b"\xff\x00{", "is not JSON"),
        (b"[{}]", "cameras[0].width is missing"),
        (b"[" * 100_000, "is not JSON for this use"),
        (b'{"frames": 3}', "frames must be a list, got 3"),
        (b" " * (33 << 20), "must have at most 32 MiB"),
        (b"[]", "holds no"),
    ],
)
def test_a_file_that_cannot_be_used_is_a_note(scene, without_cameras, content, why):
    (scene.parent / "cameras.json").write_bytes(content)
    view, _, notes = view_of(scene)
    first, *others = notes
    assert first.startswith("cameras.json lies beside the scene, but ")
    assert why in first
    assert first.endswith(": it is not used, and --camera-file none passes over it")
    off, left = without_cameras
    assert others == left
    assert np.array_equal(view.up, off.up)
    assert view.azimuth == off.azimuth


def test_strokes_have_the_view_of_their_scene_and_gaussians_in_memory_none(scene, tmp_path):
    strokes = scene.parent / "strokes.ply"
    assert main(["cluster", str(scene), "-o", str(strokes), "--strokes", "100", "--quiet"]) == 0
    view, stage, notes = view_of(strokes)
    assert (stage.counts["up_from"], notes) == ("strokes", [])
    assert np.array_equal(view.up, (0, 0, 1))
    report = Report()
    choose_first_view(bg.load(scene), ViewConfig(), None, report)
    assert "cameras.json" not in " ".join(report.notes)


def test_none_switches_it_off(scene, tmp_path, capsys):
    off = ["--camera-file", "none"]
    assert "+z by cameras.json beside the scene" in run(capsys, "info", scene)[1]
    assert "cameras.json" not in run(capsys, "info", scene, *off)[1]
    small = "--size", "32x24", "--look", "plain", "--see", "off"
    for command, output, *more in (("render", "out.png", *small), ("prune", "out.ply")):
        for words, is_told in (([], True), (off, False)):
            out = run(capsys, command, scene, *words, "-o", tmp_path / output, *more, "--json")[1]
            assert any("cameras.json" in note for note in json.loads(out)["notes"]) == is_told


def test_a_sheet_begins_with_the_sides_that_were_photographed(scene):
    turned = moved_cameras(photographs(arc=100.0, high=10.0), rotation=ON_SIDE)
    write_cameras(scene.parent / "cameras.json", turned)
    view = view_of(scene)[0]
    assert view.stood is not None
    rows = plan_sheet(view, ViewConfig())
    azimuths = [round(np.degrees(cell.config.azimuth)) % 360 for cell in rows[0]]
    is_known = [min(abs(azimuth - 50), abs(azimuth - 410)) <= 50 + 22.5 for azimuth in azimuths]
    assert is_known == sorted(is_known, reverse=True)
    assert 2 <= sum(is_known) <= 4
    assert [row[0].config.elevation > np.radians(30) for row in rows] == [False, False, True]
