"""Styles and adjustments of a painting: dialled, mixed, and the same for all that belongs to it."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats.pictures.images import read_image
from brushgs.formats.styles import write_style
from brushgs.options.styling import AdjustConfig, StyleConfig
from brushgs.pipeline.color_changes import adjust_change
from brushgs.pipeline.media.materials import BACKDROP
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.still_life import still_life_camera
from brushgs.values.sh import base_colors
from brushgs.values.style import StyleEdit
from tests.kit import BLIND, changed, for_each, refused, run, still_life_of, without_look

SCENE = still_life_of(1000)
SIZE = (96, 72)
CAMERA = still_life_camera(width=SIZE[0], height=SIZE[1])
PAINT = changed(
    without_look("flat", 250, SIZE, prune={"keep": 1.0}, strokes=BLIND | {"broken_color": 0.0}),
    draw={"streaks": 0.0},  # these come after a style, and are no map of it
    ground={"ground": "#7f6040", "backdrop": 60, "backdrop_always": True},
)
NEGATIVE = StyleEdit(np.column_stack([-np.eye(3), np.ones(3)]))
DIMMED = StyleEdit(np.column_stack([0.5 * np.eye(3), np.zeros(3)]))


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    path = tmp_path_factory.mktemp("styles")
    write_style(bg.Style("negative", edit=NEGATIVE), path / "negative.style")
    write_style(bg.Style("dimmed", edit=DIMMED), path / "dimmed.style")
    write_style(bg.Style("larger", edit=replace(NEGATIVE, log_size=0.5)), path / "larger.style")
    return path


def config_of(text, folder, **fields):
    parts = [f"{folder}/{part}" for part in text.split(",")]
    return replace(PAINT, style=StyleConfig.parse(",".join(parts)), **fields)


@pytest.fixture(scope="module")
def picture_of(place):
    def picture(text):
        return bg.paint(SCENE, config_of(text, place), camera=CAMERA).rgb

    return picture


def test_an_affine_style_is_a_map_of_the_picture_the_dial_and_the_mix_are_linear(picture_of, place):
    plain, whole, negative = map(picture_of, ("negative.style:0", "dimmed.style", "negative.style"))
    np.testing.assert_array_equal(bg.paint(SCENE, PAINT, camera=CAMERA).rgb, plain)
    # Strokes that were beyond 0 to 1 are clipped at the other end.
    assert np.abs(negative - (1 - plain)).mean() < 2e-3
    for share in (0.25, 0.6):
        found = picture_of(f"dimmed.style:{share}")
        # Highlights are clipped.
        np.testing.assert_allclose(found, plain + share * (whole - plain), atol=6e-3)
    found = picture_of("dimmed.style:0.5,negative.style:0.25")
    mixed = plain + 0.5 * (whole - plain) + 0.25 * (negative - plain)
    assert np.abs(found - mixed).mean() < 2e-3
    # An edit changes sizes in its share, too.
    configs = PAINT, config_of("larger.style:0.5", place)
    small, large = (prepare(SCENE, config, Report(), views=CAMERA).strokes.scales for config in configs)
    np.testing.assert_allclose(large, small * np.exp(0.25), rtol=1e-5)


def test_what_lies_around_a_scene_takes_the_style_too(place):
    configs = PAINT, config_of("negative.style", place)
    coats = [prepare(SCENE, config, Report()).painting.coats[0] for config in configs]
    assert [coat.name for coat in coats] == [BACKDROP, BACKDROP]
    plain, negative = (base_colors(coat.strokes.sh) for coat in coats)
    np.testing.assert_allclose(negative, 1 - plain, atol=1e-3)


def test_a_change_is_fitted_once_to_the_first_strokes_there_are():
    change = adjust_change(AdjustConfig(contrast=1.5))
    assert len(change(SCENE.take(slice(0)))) == 0
    assert change.map is None
    change(SCENE.take(slice(500)))
    fitted = change.map
    change(SCENE)
    assert change.map is fitted


def test_the_command_line_says_the_same(scene, place, folder, capsys):
    words = ["render", scene, "--look", "plain", "--strokes", "100", "--size", "48x36", "--see", "off"]
    style = ["--style", f"{place}/negative.style:70%", "--adjust", "contrast=1.2,brightness=-5%"]
    assert run(capsys, *words, *style, "-o", "a.png")[0] == 0
    assert run(capsys, *words, "-o", "plain.png")[0] == 0
    assert np.abs(read_image("a.png") - read_image("plain.png")).max() > 0.2


@for_each(
    ("words", "sentence"),
    [
        (["--style", "a.style:1.4"], "--style must have shares of 0 to 1, got 1.4; for 1.4 % write 0.014"),
        (["--adjust", "saturation"], "--adjust must be brightness, contrast, saturation, temperature"),
        (["--swap", "#123:#456"], "--swap must be two colors such as"),
    ],
)
def test_what_cannot_be_gets_one_sentence(scene, folder, capsys, words, sentence):
    assert sentence in refused(capsys, "render", scene, "-o", "a.png", *words)
