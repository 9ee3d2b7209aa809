import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from PIL import Image

import brushgs as bg
from brushgs.formats.pictures.images import read_image
from brushgs.formats.registry import PICTURE_SUFFIXES
from brushgs.options.painting import (
    ClusterConfig,
    DrawConfig,
    PaintConfig,
    PruneConfig,
    StrokesConfig,
    ViewConfig,
)
from brushgs.outlets.demo import paint_demo, paint_moving_demo
from brushgs.outlets.passes import cluster_file, prune_file
from brushgs.pipeline import outputs
from brushgs.pipeline.outputs import check_output
from brushgs.pipeline.report import Report
from brushgs.pipeline.still import paint, paint_file
from brushgs.pipeline.strokes import load_scene
from brushgs.pipeline.views import choose_camera, choose_first_view
from brushgs.still_life.moving import still_life_moving
from brushgs.values.notes import LoadNotes
from tests.kit.for_each import for_each
from tests.scenes import still_life_of

SMALL = ViewConfig(size=(64, 48))


@pytest.fixture(scope="module")
def gaussians():
    return still_life_of(1000)


@pytest.fixture(scope="module")
def scene(gaussians, tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "still_life.ply"
    bg.save(gaussians, path)
    return path


def config(stroke="ellipse", strokes=200, see="off", **steps):
    """A small painting; strokes see only where a test is about that, for it takes most of the time."""
    return PaintConfig(
        **{
            "cluster": ClusterConfig(strokes=strokes),
            "draw": DrawConfig(stroke=stroke),
            "view": SMALL,
            "strokes": StrokesConfig(see=see),
        }
        | steps
    )


def stage(report, name):
    (found,) = [stage for stage in report.stages if stage.name == name]
    return found


def test_a_file_and_its_gaussians_give_the_same_picture(scene, tmp_path):
    paint_file(scene, tmp_path / "a.png", config())
    frame = paint(bg.load(scene), config())
    expected = np.rint(np.clip(frame.over((1, 1, 1)), 0, 1) * 255)
    assert np.abs(read_image(tmp_path / "a.png") * 255 - expected).max() <= 1


def test_a_painting_repeats_to_the_byte_for_any_number_of_threads(scene, tmp_path):
    for name, threads in (("a", 1), ("b", 3)):
        draw = DrawConfig(stroke="swirl", threads=threads)
        paint_file(scene, tmp_path / f"{name}.png", config(draw=draw, see="views"))
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_the_camera_does_not_depend_on_how_many_strokes_are_painted(scene):
    cameras = []
    for strokes in (10, 500):
        report = Report()
        loaded, notes = load_scene(scene, report)
        first_view = choose_first_view(loaded, SMALL, notes, report)
        cameras.append(choose_camera(first_view, SMALL, report))
        paint(loaded, config(strokes=strokes), camera=cameras[-1])
    np.testing.assert_array_equal(cameras[0].viewmat, cameras[1].viewmat)


def test_what_a_scene_does_not_need_is_left_out_and_said(gaussians, tmp_path):
    flat = bg.Gaussians(
        gaussians.means,
        gaussians.quats,
        gaussians.scales,
        gaussians.opacities,
        np.concatenate([gaussians.sh[:, :4], 0 * gaussians.sh[:, 4:]], axis=1),
    )
    report = Report()
    whole = config("gaussian", strokes=None, prune=PruneConfig(keep=1.0))
    paint(flat, whole, report=report)
    assert stage(report, "prune").skipped == ["pruning: keep = 1"]
    assert stage(report, "cluster").skipped == ["clustering: every Gaussian is a stroke"]
    assert "SH degrees 2 to 3 skipped: zero in every row" in stage(report, "project").details
    assert stage(report, "rasterise").details == ["no texture filter: a kernel is computed, not sampled"]
    bg.save(flat, tmp_path / "flat.ply")
    report = paint_file(tmp_path / "flat.ply", tmp_path / "a.png", whole)
    assert stage(report, "load").details == ["SH degrees 2 to 3 skipped: zero in every row"]
    assert "no depth: this file format does not hold it" in stage(report, "rasterise").details


def test_a_share_of_strokes_is_of_the_scene_as_loaded(gaussians):
    report = Report()
    paint(gaussians, config(strokes=0.1, prune=PruneConfig(keep=0.5)), report=report)
    assert stage(report, "cluster").counts["asked"] == -(-len(gaussians) // 10)


@pytest.mark.parametrize("suffix", PICTURE_SUFFIXES)
def test_every_kind_of_picture_is_written(scene, tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    report = paint_file(scene, path, config(view=ViewConfig(size=(40, 30))))
    if suffix == ".avif":  # which is not read
        with Image.open(path) as picture:
            assert picture.size == (40, 30)
    else:
        assert read_image(path).shape[:2] == (30, 40)
    has_depth = not any(line.startswith("no depth") for line in stage(report, "rasterise").details)
    assert has_depth == (suffix == ".exr")


def test_transparent_keeps_alpha_and_a_colour_fills_it(scene, tmp_path):
    view = ViewConfig(size=(40, 30), zoom=0.3)
    for ground in ("transparent", "#102030"):
        path = tmp_path / f"{ground.strip('#')}.png"
        paint_file(scene, path, config(view=view, draw=DrawConfig(stroke="ellipse", background=ground)))
    assert read_image(tmp_path / "transparent.png")[0, 0, 3] == 0
    np.testing.assert_allclose(read_image(tmp_path / "102030.png")[0, 0] * 255, (16, 32, 48), atol=1e-3)


def test_an_image_as_background_fills_the_picture(scene, tmp_path):
    ground = np.zeros((10, 30, 3), np.float32)
    ground[:, 15:] = 1  # left black, right white; the picture is narrower, so both ends are cut
    bg.save(bg.Frame(ground, np.ones((10, 30), np.float32)), tmp_path / "ground.png")
    view = ViewConfig(size=(40, 40), zoom=0.05)
    draw = DrawConfig(stroke="ellipse", background=str(tmp_path / "ground.png"))
    report = paint_file(scene, tmp_path / "a.png", config(view=view, draw=draw))
    pixels = read_image(tmp_path / "a.png")
    assert pixels[0, :15].max() < 0.05
    assert pixels[0, 25:].min() > 0.95
    assert stage(report, "background").counts == {"path": str(tmp_path / "ground.png")}


def test_a_camera_file_gives_the_view_and_its_size(scene, tmp_path):
    entry = {
        "id": 0,
        "img_name": "a",
        "width": 50,
        "height": 20,
        "position": [0, -2, -12],
        "rotation": np.eye(3).tolist(),
        "fx": 40.0,
        "fy": 40.0,
    }
    path = tmp_path / "cameras.json"
    path.write_text(json.dumps([entry, entry | {"id": 1, "width": 30}]))
    view = ViewConfig(camera_file=path, view=1)
    report = paint_file(scene, tmp_path / "a.png", config(view=view))
    assert read_image(tmp_path / "a.png").shape == (20, 30, 3)
    assert stage(report, "camera").did == "view 1 of 2 in cameras.json, 30x20"
    view = ViewConfig(camera_file=path, size=(60, 40))
    paint_file(scene, tmp_path / "b.png", config(view=view))
    assert read_image(tmp_path / "b.png").shape == (40, 60, 3)
    with pytest.raises(bg.SceneError, match=r"has 2 views, 0 to 1; there is no view 2"):
        paint_file(scene, tmp_path / "c.png", config(view=ViewConfig(camera_file=path, view=2)))
    assert not (tmp_path / "c.png").exists()


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


@pytest.mark.parametrize(
    ("opacity", "zoom", "why"),
    [
        (0.005, 0.05, r"since they are faint: their mean opacity is 0\.0[0-9]+; run `brushgs doctor`"),
        (1.0, 0.005, r"since few or small ones lie in view; take a larger --zoom or another view"),
    ],
)
def test_a_nearly_blank_picture_says_why(gaussians, opacity, zoom, why):
    opacities = np.full(len(gaussians), opacity, np.float32)
    view = ViewConfig(size=(64, 48), zoom=zoom)
    with pytest.warns(bg.SceneWarning, match=f"nearly blank: strokes cover 0.[0-9]+% of it, {why}") as caught:
        paint(replace(gaussians, opacities=opacities), config(view=view))
    assert len(caught) == 1


@pytest.mark.parametrize(
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
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "input.png").write_text("scene")
    (tmp_path / "link.png").symlink_to(tmp_path / "input.png")
    with pytest.raises(ValueError, match=sentence):
        check_output(tmp_path / name, PICTURE_SUFFIXES, inputs=(tmp_path / "input.png",))
    assert (tmp_path / "input.png").read_text() == "scene"


@pytest.mark.parametrize("name", ["a.jpg", "a.JPEG"])
def test_a_jpeg_is_not_transparent(scene, tmp_path, name):
    draw = DrawConfig(stroke="ellipse", background="Transparent")
    with pytest.raises(ValueError, match=r"background must not be transparent in a\..* or write a\.png"):
        paint_file("missing.ply", tmp_path / name, config(draw=draw))


def test_a_folder_that_refuses_is_found_before_the_work(tmp_path, monkeypatch):
    def refuse(**_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(outputs.tempfile, "TemporaryFile", refuse)
    with pytest.raises(bg.SceneError, match=r"a\.png: cannot be written: permission denied"):
        check_output(tmp_path / "a.png", PICTURE_SUFFIXES)


@pytest.mark.parametrize("ground", ["redish", "#12345", "#gggggg", "no_such.png", ""])
def test_a_background_that_means_nothing_is_refused_before_the_work(tmp_path, ground):
    with pytest.raises(ValueError, match=r"background must be white, .*, transparent, #rrggbb or an image"):
        paint_file(tmp_path / "none.ply", tmp_path / "a.png", config(draw=DrawConfig(background=ground)))


def test_a_background_that_is_no_picture_is_refused_before_the_work(scene, tmp_path):
    (tmp_path / "ground.png").write_text("no picture")
    report = Report()
    draw = DrawConfig(stroke="ellipse", background=str(tmp_path / "ground.png"))
    with pytest.raises(bg.SceneError, match=r"ground\.png"):
        paint_file(scene, tmp_path / "a.png", config(draw=draw), report=report)
    assert "prune" not in [stage.name for stage in report.stages]
    assert not (tmp_path / "a.png").exists()


def test_a_view_that_sees_nothing_is_painted_with_a_warning(gaussians):
    away = bg.Camera.look_at((0, 0, -50), (0, 0, -100), width=8, height=6)
    with pytest.warns(bg.SceneWarning, match="no stroke is in the picture"):
        frame = paint(gaussians, config(strokes=None), camera=away)
    assert not frame.alpha.any()


def test_a_scene_that_is_too_faint_says_so_and_does_not_blame_the_camera(gaussians):
    faint = replace(gaussians, opacities=np.full(len(gaussians), 0.0031, gaussians.opacities.dtype))
    with pytest.warns(bg.SceneWarning, match="all opacities are under 1/255, the largest 0.003"):
        paint(faint, config(strokes=None))


def test_passes_stand_alone(scene, tmp_path):
    report = prune_file(scene, tmp_path / "p.ply", PruneConfig(keep=0.25), Report())
    pruned = bg.load(tmp_path / "p.ply")
    assert len(pruned) == stage(report, "write").counts["gaussians"]
    report = cluster_file(tmp_path / "p.ply", tmp_path / "c.ply", config(strokes=50), Report())
    assert 0 < len(bg.load(tmp_path / "c.ply")) <= 50
    assert report.output == str(tmp_path / "c.ply")


def test_the_demo_writes_a_scene_and_its_picture(tmp_path):
    report = paint_demo(
        tmp_path / "deep" / "folder",
        config(view=ViewConfig(size=(80, 60)), draw=DrawConfig(stroke="flat", background="black")),
        report=Report(),
        num_gaussians=1000,
    )
    assert report.output == str(tmp_path / "deep" / "folder" / "still_life-flat.png")
    pixels = read_image(report.output)
    assert pixels.shape == (60, 80, 3)
    assert pixels.std() > 0.1
    assert bg.load(tmp_path / "deep" / "folder" / "still_life.ply").sh_degree == 3


def test_the_moving_demo_writes_a_scene_file_a_moment_and_a_film(tmp_path, monkeypatch):
    monkeypatch.setattr("brushgs.outlets.demo.SECONDS", 4 / 24)
    monkeypatch.setattr("brushgs.outlets.demo.still_life_moving", partial(still_life_moving, seconds=4 / 24))
    small = replace(config(), view=ViewConfig(size=(64, 48)))
    small = replace(small, cluster=replace(small.cluster, seed=1))
    report = paint_moving_demo(tmp_path / "folder", small, report=Report(), num_gaussians=1000)
    clip = tmp_path / "folder" / "still_life_moving"
    assert report.output == str(tmp_path / "folder" / "still_life_moving-ellipse.mp4")
    files = sorted(clip.iterdir())
    assert [path.name for path in files] == [f"moment_{k:05d}.ply" for k in range(4)]
    first, last = bg.load(files[0]), bg.load(files[-1])
    np.testing.assert_array_equal(first.means, still_life_of(1000, 1).means)
    assert len(first) == len(last)
    moving = bg.load_moving(clip)
    assert moving.has_rows
    assert (len(moving.times), moving.duration) == (4, 4 / 24)


def test_a_demo_into_a_file_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(bg.SceneError, match="is a file, not a folder; choose another name"):
        paint_demo(tmp_path / "file" / "folder", PaintConfig(), report=Report())


def test_the_json_of_a_report_has_every_stage(scene, tmp_path):
    value = json.loads(paint_file(scene, tmp_path / "a.png", config()).as_json())
    assert set(value) == {"schema", "output", "seconds", "peak_memory_bytes", "notes", "stages"}
    assert value["schema"] == 2
    for entry in value["stages"]:
        assert set(entry) == {"name", "seconds", "did", "counts", "skipped", "details"}
    assert value["seconds"] >= sum(entry["seconds"] for entry in value["stages"]) - 1e-3
    assert value["peak_memory_bytes"] > 1e7


@for_each(
    ("make", "sentence"),
    [
        (lambda: PruneConfig(keep=30), r"keep must be above 0 and at most 1, got 30; for 30 % write 0.3"),
        (lambda: PruneConfig(keep=0), r"keep must be above 0 and at most 1, got 0$"),
        (lambda: PruneConfig(keep=float("nan")), "keep must be above 0 and at most 1, got nan"),
        (lambda: ClusterConfig(strokes=0), "strokes must be a count >= 1 or a share"),
        (lambda: ClusterConfig(seed=2**32), "seed must be 0 to 4294967295, got 4294967296"),
        (lambda: ClusterConfig(strokes=1.5), "strokes must be a count >= 1 or a share"),
        (lambda: ViewConfig(size=(0, 5)), "size must be 1x1 to 32767x32767 pixels, got 0x5"),
        (lambda: ViewConfig(view=-1), "view must be 0 or more"),
        (lambda: ViewConfig(fov_y=4.0), r"fov-deg must be above 0 and below 180 degrees, got 229"),
        (lambda: ViewConfig(elevation=2.0), "elevation must be -90 to 90 degrees, got 114"),
        (lambda: ViewConfig(zoom=0.0), "zoom must be above 0, got 0"),
        (lambda: DrawConfig(threads=100_000), "threads must be 1 to 1024, got 100000"),
        (lambda: DrawConfig(threads=0), "threads must be 1 to 1024, got 0"),
    ],
)
def test_a_configuration_refuses_what_makes_no_sense(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()


@for_each(("asked", "num"), [(None, 1000), (0.1, 100), (0.0001, 1), (7000, 7000), (1.0, 1000)])
def test_strokes_are_a_count_a_share_or_all(asked, num):
    assert ClusterConfig(strokes=asked).num_strokes(1000) == num
