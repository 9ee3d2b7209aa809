"""`brushgs style learn --before --after`: a style of an edit from scenes, or from pictures of one."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.cameras.framing import plain_first_view
from brushgs.cli import main
from brushgs.formats.pictures.images import read_image
from brushgs.formats.styles import read_style
from brushgs.passes.color.color_map import Affine, map_colors
from brushgs.passes.style.edit import apply_edit, needed_features
from brushgs.passes.style.features import stroke_features
from brushgs.still_life import still_life_camera
from brushgs.values.sh import C0
from tests.kit import for_each, refused, save_opaque, save_upright, still_life_of, write_cameras

MATRIX, OFFSET = np.array([[0.9, 0.1, 0], [0, 0.8, 0.1], [0.05, 0, 0.6]]), np.array([0.04, 0.02, 0.1])


@pytest.fixture(autouse=True)
def scene(folder):
    """The still life before and after an edit, in the current folder."""
    save_upright(still_life_of(1000), "scene.ply")
    bg.save(map_colors(still_life_of(1000), Affine(MATRIX, OFFSET)), "dusk.ply")
    return bg.load("scene.ply")


def save_pictures(scene, name, views, size=(96, 72)):
    """Pictures of a scene in 8 bits, and a file of their cameras."""
    Path(name).mkdir()
    cameras = []
    for number, angle in enumerate(views):
        turn = np.eye(4)
        turn[0, 0] = turn[2, 2] = np.cos(angle)
        turn[0, 2], turn[2, 0] = np.sin(angle), -np.sin(angle)
        own = still_life_camera(width=size[0], height=size[1])
        cameras.append(bg.Camera(own.viewmat @ turn, own.K, *size))
        save_opaque(f"{name}/{number}.png", bg.render(scene, cameras[-1], "gaussian").over("#808080"))
    write_cameras("cameras.json", cameras, [str(number) for number in range(len(views))])


OF_PICTURES = ["--scene", "scene.ply", "--camera-file", "cameras.json"]


def learn(*words):
    assert main(["style", "learn", *words, "--quiet"]) == 0


def test_the_edit_between_two_scenes_becomes_a_style_file():
    learn("--before", "scene.ply", "--after", "dusk.ply")
    style = read_style("dusk.style")
    assert (style.name, style.kind) == ("dusk", "edit")
    np.testing.assert_allclose(style.edit.affine, np.column_stack([MATRIX, OFFSET]), atol=1e-5)
    assert style.edit.residual is None


def test_the_edit_of_pictures_is_learnt_by_the_gaussians_that_they_show(scene):
    save_pictures(scene, "before", (-0.2, 0.0, 0.2))
    Path("after").mkdir()
    for file in Path("before").iterdir():  # an edit of pictures: their pixels, whatever they show
        save_opaque(f"after/{file.name}", read_image(file)[..., :3] @ MATRIX.T + OFFSET)
    words = [*OF_PICTURES, "-o", "warm.style", "--name", "warm dusk"]
    learn("--before", "before", "--after", "after", *words)
    style = read_style("warm.style")
    assert style.name == "warm dusk"
    np.testing.assert_allclose(style.edit.affine, np.column_stack([MATRIX, OFFSET]), atol=0.02)


def test_a_picture_that_was_painted_over_needs_none_before_it_and_has_marks(scene):
    save_pictures(scene, "plain", (0.0,))
    Path("over").mkdir()
    picture = read_image("plain/0.png")[..., :3] @ MATRIX.T + OFFSET
    y, x = np.mgrid[: picture.shape[0], : picture.shape[1]]
    hatched = np.clip(picture + 0.12 * np.sign(np.sin(x + 0.5 * y))[..., None], 0, 1)
    save_opaque("over/0.png", hatched)
    learn("--after", "over/0.png", *OF_PICTURES, "-o", "mine.style")
    style = read_style("mine.style")
    np.testing.assert_allclose(style.edit.affine, np.column_stack([MATRIX, OFFSET]), atol=0.1)
    pairs = style.marks.directions.reshape(-1, 2).sum(axis=0)
    angle = np.degrees(0.5 * np.arctan2(pairs[1], pairs[0]))
    assert abs((angle - np.degrees(np.arctan2(-1, 0.5)) + 90) % 180 - 90) < 15


@for_each(
    ("words", "sentence"),
    [
        (["--before", "scene.ply"], "style learn needs --after too"),
        (["--after", "scene.ply"], "style learn needs --before too"),
        (["a.jpg", "--before", "scene.ply", "--after", "dusk.ply"], "takes a painting, or --before"),
        (["--before", "a", "--after", "b", "--scene", "scene.ply"], "--scene needs --camera-file"),
        (["--before", "a", "--after", "b", "--camera-file", "c"], "--camera-file needs --scene"),
        (["--before", "scene.ply", "--after", "other.ply"], "0 lie where one of the"),
        (["--before", "scene.ply", "--after", "dusk.ply", "-o", "scene.ply"], "style"),
    ],
)
def test_what_does_not_fit_is_refused_in_a_sentence(folder, scene, capsys, words, sentence):
    bg.save(replace(scene, means=scene.means + np.float32(100)), "other.ply")
    assert sentence in refused(capsys, "style", "learn", *words, "--quiet")
    assert not list(folder.glob("*.style"))


def test_pictures_that_do_not_belong_together_are_refused(scene, capsys):
    save_pictures(scene, "before", (0.0, 0.2))
    save_pictures(scene, "after", (0.0,))
    words = ["style", "learn", "--before", "before", *OF_PICTURES, "--after"]
    assert "name each picture as the picture of its camera" in refused(capsys, *words, "after")
    Path("before/1.png").unlink()
    save_pictures(scene, "wide", (0.0,), size=(96, 48))
    save_pictures(scene, "again", (0.0,))
    sentence = "has other sides than its camera: 96x48, its camera 96x72"
    assert sentence in refused(capsys, *words, "wide")


def test_which_way_is_up_may_be_said(scene):
    view = plain_first_view(scene, "+x")
    height = np.clip(stroke_features(scene, view, ("height",)).values, 0, 1)
    sh = scene.sh.copy()
    sh[:, 0] = ((0.5 + C0 * sh[:, 0]) * (1 - 0.7 * height) - 0.5) / C0
    bg.save(replace(scene, sh=sh), "sideways.ply")
    errors = {}
    for up in ("+x", "-y"):
        learn("--before", "scene.ply", "--after", "sideways.ply", "-o", "up.style", "--up", up)
        edit = read_style("up.style").edit
        features = stroke_features(scene, view, needed_features([edit]))
        errors[up] = np.square(apply_edit(scene, edit, features).sh[:, 0] - sh[:, 0]).mean() ** 0.5
    assert errors["+x"] < 0.5 * errors["-y"]
