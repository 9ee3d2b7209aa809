import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats.pictures.images import read_image
from brushgs.formats.registry import PICTURE_SUFFIXES
from brushgs.options.painting import ClusterConfig, ViewConfig
from brushgs.pipeline import outputs
from brushgs.pipeline.outputs import check_output
from brushgs.pipeline.report import Report
from brushgs.pipeline.still import paint, paint_file
from brushgs.pipeline.views import choose_camera, choose_first_view
from brushgs.values.notes import LoadNotes
from tests.kit import for_each, save_opaque, stages, still_life_of, without_look, write_cameras


@pytest.fixture(scope="module")
def gaussians():
    return still_life_of(1000)


def config(stroke="ellipse", strokes=200, see="off", **steps):
    """A small painting; strokes see only where a test is about that, for it takes most of the time."""
    return without_look(stroke, strokes, (64, 48), strokes={"see": see}, **steps)


def test_a_painting_repeats_to_the_byte_for_any_number_of_threads(scene, tmp_path):
    for name, threads in (("a", 1), ("b", 3)):
        paint_file(scene, tmp_path / f"{name}.png", config("swirl", draw={"threads": threads}, see="views"))
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_what_a_scene_does_not_need_is_left_out_and_said(gaussians, tmp_path):
    sh = np.concatenate([gaussians.sh[:, :4], 0 * gaussians.sh[:, 4:]], axis=1)
    bg.save(replace(gaussians, sh=sh), tmp_path / "flat.ply")
    whole = config("gaussian", strokes=None, prune={"keep": 1.0})
    report = paint_file(tmp_path / "flat.ply", tmp_path / "a.png", whole)
    assert stages(report)["prune"].skipped == ["pruning: keep = 1"]
    assert stages(report)["cluster"].skipped == ["clustering: every Gaussian is a stroke"]
    assert stages(report)["load"].details == ["SH degrees 2 to 3 skipped: zero in every row"]
    assert stages(report)["rasterise"].details == [
        "no texture filter: a kernel is computed, not sampled",
        "no depth: this file format does not hold it",
    ]


def test_transparent_keeps_alpha_and_a_color_or_a_picture_fills_it(scene, folder):
    ground = np.zeros((10, 30, 3))
    ground[:, 15:] = 1  # left black, right white; the picture is narrower, so both ends are cut
    save_opaque("ground.png", ground)
    pixels = {}
    for ground in ("transparent", "#102030", "ground.png"):
        view = {"size": (40, 40), "zoom": 0.05}
        paint_file(scene, "a.png", config(view=view, draw={"background": ground}))
        pixels[ground] = read_image("a.png")
    assert pixels["transparent"][0, 0, 3] == 0
    np.testing.assert_allclose(pixels["#102030"][0, 0] * 255, (16, 32, 48), atol=1e-3)
    assert pixels["ground.png"][0, :15].max() < 0.05
    assert pixels["ground.png"][0, 25:].min() > 0.95


def test_a_camera_file_gives_the_view_and_its_size(scene, folder):
    cameras = [bg.Camera.look_at((0, -2, -12), (0, -2, 0), width=width, height=20) for width in (50, 30)]
    path = write_cameras("cameras.json", cameras)
    report = paint_file(scene, "a.png", config(view=ViewConfig(camera_file=path, view=1)))
    assert read_image("a.png").shape == (20, 30, 3)
    assert stages(report)["camera"].did == "view 1 of 2 in cameras.json, 30x20"
    paint_file(scene, "b.png", config(view=ViewConfig(camera_file=path, size=(60, 40))))
    assert read_image("b.png").shape == (40, 60, 3)
    with pytest.raises(bg.SceneError, match=r"has 2 views, 0 to 1; there is no view 2"):
        paint_file(scene, "c.png", config(view=ViewConfig(camera_file=path, view=2)))
    assert not Path("c.png").exists()


def test_the_first_view_says_which_way_is_up_and_why(gaussians):
    for file_up, asked, did in (
        (None, None, "up is -y (not sure, probability 0.80)"),
        ("+z", None, "up is +z (from the file)"),
        ("+z", "-x", "up is -x (as given)"),
        (None, (0.0, 0.0, 1.0), "up is +z (as given)"),
    ):
        report, view = Report(), ViewConfig(up=asked)
        notes = LoadNotes("PLY", len(gaussians), 0, 0, 0, file_up)
        camera = choose_camera(choose_first_view(gaussians, view, notes, report), view, report)
        assert did in report.stages[0].did
        assert (camera.width, camera.height) == (1280, 720)


@for_each(
    ("opacity", "zoom", "why"),
    [
        (0.0031, 1.0, "all opacities are under 1/255, the largest 0.003"),
        (0.005, 0.05, r"nearly blank: strokes cover 0.[0-9]+% of it, since they are faint: their mean"),
        (1.0, 0.005, "nearly blank: .* since few or small ones lie in view; take a larger --zoom or"),
    ],
)
def test_a_nearly_blank_picture_says_why(gaussians, opacity, zoom, why):
    opacities = np.full(len(gaussians), opacity, np.float32)
    with pytest.warns(bg.SceneWarning, match=why) as caught:
        paint(replace(gaussians, opacities=opacities), config(strokes=None, view={"zoom": zoom}))
    assert len(caught) == 1


@for_each(
    ("name", "sentence"),
    [
        ("a.bmp", "output must end in .png, .jpg, .jpeg, .tif, .tiff, .exr, .webp, .avif"),
        ("input.png/no/a.png", "input.png is a file, not a folder; choose another name"),
        ("folder.png", "is not a regular file"),
        ("\udcff.png", "its name is not UTF-8; choose another name"),
        ("input.png", "is the input, which is never overwritten"),
        ("link.png", "is the input, which is never overwritten"),
    ],
)
def test_an_output_that_cannot_be_is_refused(tmp_path, name, sentence):
    (tmp_path / "folder.png").mkdir(exist_ok=True)
    (tmp_path / "link.png").unlink(missing_ok=True)
    (tmp_path / "input.png").write_text("scene")
    (tmp_path / "link.png").symlink_to(tmp_path / "input.png")
    with pytest.raises(ValueError, match=sentence):
        check_output(tmp_path / name, PICTURE_SUFFIXES, inputs=(tmp_path / "input.png",))
    assert (tmp_path / "input.png").read_text() == "scene"


def test_a_folder_that_refuses_is_found_before_the_work(tmp_path, monkeypatch):
    def refuse(**_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(outputs.tempfile, "TemporaryFile", refuse)
    with pytest.raises(bg.SceneError, match=r"a\.png: cannot be written: permission denied"):
        check_output(tmp_path / "a.png", PICTURE_SUFFIXES)


@for_each(
    ("output", "ground", "sentence"),
    [
        ("a.jpg", "Transparent", r"background must not be transparent in a\..* or write a\.png"),
        ("a.JPEG", "transparent", r"background must not be transparent in a\..* or write a\.png"),
        ("a.png", "#12345", "background must be white, .*, transparent, #rrggbb or an image"),
        ("a.png", "#gggggg", "background must be white, .*, transparent, #rrggbb or an image"),
        ("a.png", "no_such.png", "background must be white, .*, transparent, #rrggbb or an image"),
        ("a.png", "", "background must be white, .*, transparent, #rrggbb or an image"),
    ],
)
def test_a_background_that_cannot_be_is_refused_before_the_work(folder, output, ground, sentence):
    with pytest.raises(ValueError, match=sentence):
        paint_file("none.ply", output, config(draw={"background": ground}))


def test_a_view_that_sees_nothing_is_painted_with_a_warning(gaussians):
    away = bg.Camera.look_at((0, 0, -50), (0, 0, -100), width=8, height=6)
    with pytest.warns(bg.SceneWarning, match="no stroke is in the picture"):
        frame = paint(gaussians, config(strokes=None), camera=away)
    assert not frame.alpha.any()


def test_the_json_of_a_report_has_every_stage(scene, tmp_path):
    value = json.loads(paint_file(scene, tmp_path / "a.png", config()).as_json())
    assert set(value) == {"schema", "output", "seconds", "peak_memory_bytes", "notes", "stages"}
    assert value["schema"] == 2
    for entry in value["stages"]:
        assert set(entry) == {"name", "seconds", "did", "counts", "skipped", "details"}
    assert value["seconds"] >= sum(entry["seconds"] for entry in value["stages"]) - 1e-3
    assert value["peak_memory_bytes"] > 1e7


@for_each(("asked", "num"), [(None, 1000), (0.1, 100), (0.0001, 1), (7000, 7000), (1.0, 1000)])
def test_strokes_are_a_count_a_share_or_all(asked, num):
    assert ClusterConfig(strokes=asked).num_strokes(1000) == num


@for_each(
    ("make", "sentence"),
    [
        (lambda: ClusterConfig(strokes=0), "strokes must be a count >= 1 or a share"),
        (lambda: ClusterConfig(strokes=1.5), "strokes must be a count >= 1 or a share"),
        (lambda: ViewConfig(size=(0, 5)), "size must be 1x1 to 32767x32767 pixels, got 0x5"),
    ],
)
def test_counts_and_sizes_that_are_none_are_refused(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()
