"""`brushgs.paint` with options gives the picture that `brushgs render` writes, bit for bit."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.cli import main
from brushgs.formats.pictures.images import read_image
from brushgs.options.painting import PaintConfig
from brushgs.pipeline.report import Report
from brushgs.still_life.moving import still_life_moving
from tests.kit.for_each import for_each
from tests.scenes import still_life_of

SMALL = {"size": (64, 48), "strokes": 60}


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({}, ""),
        ({"look": "plain", "from_": "left", "background": "teal"}, "--from left --background teal"),
        ({"look": "plain", "stroke": ["flat", "dab"], "first": "40%"}, "--stroke flat,dab --first 0.4"),
        ({"look": "plain", "stroke_size": 24, "strokes": None}, "--stroke-size 24px"),
        ({"look": "plain", "adjust": {"contrast": 1.3}}, "--adjust contrast=1.3"),
        ({"preset": "paper", "stroke": "gaussian", "strokes": None}, "--stroke gaussian"),
    ],
)
def test_paint_is_what_render_writes(scene, tmp_path, options, words):
    frame, file = bg.paint(scene, **SMALL | options), tmp_path / "a.png"
    shared = [f"--{name}={options[name]}" for name in ("look", "preset") if name in options]
    count = [] if "strokes" in options else ["--strokes", "60"]
    words = ["--size", "64x48", *shared, *count, *words.split(), "--quiet"]
    assert main(["render", str(scene), "-o", str(file), *words]) == 0
    np.testing.assert_array_equal(frame.bytes_over("black"), np.rint(255 * read_image(file)))
    assert frame.alpha.min() == 1


def test_gaussians_and_looks_are_taken_and_a_camera_takes_the_place_of_the_view(scene):
    again = bg.paint(bg.load(scene), bg.Look.open("gouache"), up="-y", see="off", **SMALL)
    np.testing.assert_array_equal(bg.paint(scene, "gouache", see="off", **SMALL).rgb, again.rgb)
    camera, report = bg.Camera.look_at((0, -1, -4), (0, 0, 0), width=40, height=30), Report()
    frame = bg.paint(scene, camera=camera, strokes=100, report=report)
    assert frame.rgb.shape == (30, 40, 3)
    assert "cluster" in [stage.name for stage in report.stages]


def test_a_config_is_all_options(scene):
    config = PaintConfig.of({"cluster": {"strokes": 50}, "view": {"size": (32, 24)}})
    assert bg.paint(scene, config).alpha.min() < 0.1
    with pytest.raises(ValueError, match="paint: zoom belongs in the PaintConfig"):
        bg.paint(scene, config, zoom=2)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"orbit": 9}, "paint: orbit belongs to films; use `brushgs render`, or brushgs.paint_film"),
        ({"start": 1}, "start belongs to films"),
        ({"output": "a.png"}, "output belongs to files; use `brushgs render`, or brushgs.save"),
        ({"json": True}, "json belongs to the command; give report="),
        ({"strokez": 1}, "did you mean 'stroke"),
        ({"stroke_size": 4, "strokes": 4}, "cannot be combined with"),
        ({"azimuth": 3, "from_": "left"}, "--azimuth cannot be combined with --from"),
    ],
)
def test_what_one_picture_does_not_take_is_refused(scene, options, message):
    with pytest.raises(ValueError, match=message):
        bg.paint(scene, **options)


@pytest.mark.filterwarnings("ignore:.*taken for moments")
def test_a_moving_scene_needs_a_moment(tmp_path):
    moving = still_life_moving(1000)
    folder = tmp_path / "frames"
    folder.mkdir()
    for number, time in enumerate((0.0, 0.5, 1.0)):
        bg.save(moving.at(time), folder / f"{number:03}.ply")
    with pytest.raises(ValueError, match=r"moves; give time=, one moment, or use brushgs\.paint_film"):
        bg.paint(folder, **SMALL)
    assert bg.paint(folder, time="50%", **SMALL).rgb.shape == (48, 64, 3)


def test_the_stub_of_keywords_is_what_its_script_writes():
    script = Path(__file__).resolve().parent.parent / ".ci" / "keywords"
    names = runpy.run_path(str(script))
    assert names["STUB"].read_text(encoding="utf-8") == names["stub"](), "run .ci/keywords"


@for_each(
    ("paint", "message"),
    [
        (lambda g, c: bg.render("a.ply", c, "flat"), "render: gaussians must be Gaussians, got str; load"),
        (lambda g, c: bg.render(c, g, "flat"), "got Camera; the camera comes second"),
        (lambda g, c: bg.render(g, g, "flat"), "render: camera must be a Camera, got Gaussians"),
        (lambda g, c: bg.render(g, c, "flat", streaks="x"), "render: streaks must be a number, got 'x'"),
        (lambda g, c: bg.render(g, c, "flat", layers="normal"), r"layers must be a list .* \['normal'\]"),
        (lambda g, c: bg.render(g, c, 5), "texture must be a StrokeTexture, .* got int"),
        (lambda g, c: bg.render_sequence(g, c, "flat"), "cameras must be a list of Cameras, got a Camera"),
        (lambda g, c: bg.paint(5), "paint: scene must be Gaussians, or a file, .* got int"),
        (lambda g, c: bg.paint(g, 5), "paint: look must be a look, its name or its file, .* got int"),
        (lambda g, c: bg.paint_film(5, "a.mp4"), "paint_film: scene must be .* got int"),
    ],
)
def test_another_type_gets_one_sentence(paint, message):
    camera = bg.Camera.look_at((0, -1, -4), (0, 0, 0), width=40, height=30)
    with pytest.raises(TypeError, match=message):
        list(paint(still_life_of(1000), camera))


def test_a_picture_in_memory_is_a_texture():
    camera = bg.Camera.look_at((0, -1, -4), (0, 0, 0), width=40, height=30)
    gaussians, mask = still_life_of(1000), np.zeros((16, 32), np.float32)
    mask[4:12, 4:28] = 1
    frame = bg.render(gaussians, camera, mask)
    again = bg.render(gaussians, camera, bg.StrokeTexture.from_coverage(mask))
    np.testing.assert_array_equal(frame.rgb, again.rgb)
    rgba = np.zeros((16, 32, 4), np.uint8)
    rgba[4:12, 4:28] = 255
    assert bg.StrokeTexture.of(rgba).coverage.shape == (8, 24)
    for wrong in (np.zeros((2, 2, 2, 2)), np.full((4, 4, 3), 7.0), np.zeros((4, 4, 3), np.int64)):
        with pytest.raises((ValueError, TypeError), match=r"^texture must"):
            bg.render(gaussians, camera, wrong)


def test_a_film_takes_the_options_of_render(tmp_path):
    moving = still_life_moving(1000, seconds=0.2)
    options = {"size": (32, 24), "strokes": 60, "azimuth": 20}
    report = bg.paint_film(moving, tmp_path / "f" / "%02d.png", "plain", fps=10, speed=0.5, **options)
    assert report.output == str(tmp_path / "f" / "%02d.png")
    assert len(list((tmp_path / "f").glob("*.png"))) == 5  # both ends of 0.4 seconds
    with pytest.raises(ValueError, match=r"paint_film: first belongs to one picture; use brushgs\.paint"):
        bg.paint_film(moving, "a.mp4", first=0.5)
    with pytest.raises(ValueError, match="clip cannot be combined with options that describe one"):
        bg.paint_film(moving, "a.mp4", clip=bg.ClipConfig(), speed=2)
