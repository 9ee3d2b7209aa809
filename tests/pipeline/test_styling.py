"""Styles and adjustments of a painting: dialled, mixed, and the same for all that belongs to it."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.cli import main
from brushgs.errors import SceneError
from brushgs.formats.pictures.images import read_image
from brushgs.formats.styles_write import write_style
from brushgs.options.look_parts import GroundConfig
from brushgs.options.painting import (
    ClusterConfig,
    DrawConfig,
    PaintConfig,
    PruneConfig,
    StrokesConfig,
    ViewConfig,
)
from brushgs.options.sequence import PathConfig, SequenceConfig
from brushgs.options.styling import StyleConfig
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.sequence import paint_sequence
from brushgs.still_life import still_life_camera
from brushgs.values.style import Style, StyleEdit
from tests.scenes import still_life_of

SIZE = (96, 72)
CAMERA = still_life_camera(width=SIZE[0], height=SIZE[1])
PAINT = PaintConfig(
    prune=PruneConfig(keep=1.0),
    cluster=ClusterConfig(250),
    draw=DrawConfig("flat", streaks=0.0),  # these come after a style, and are no map of it
    strokes=StrokesConfig(see="off", broken_color=0.0),
    view=ViewConfig(size=SIZE),
    ground=GroundConfig("#7f6040", backdrop=60, backdrop_always=True),
)
NEGATIVE = StyleEdit(np.column_stack([-np.eye(3), np.ones(3)]))
DIMMED = StyleEdit(np.column_stack([0.5 * np.eye(3), np.zeros(3)]))


@pytest.fixture(scope="module")
def scene():
    return still_life_of(1000)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("styles")
    write_style(Style("negative", edit=NEGATIVE), path / "negative.style")
    write_style(Style("dimmed", edit=DIMMED), path / "dimmed.style")
    write_style(Style("larger", edit=replace(NEGATIVE, log_size=0.5)), path / "larger.style")
    return path


def config_of(text, folder, **fields):
    parts = [f"{folder}/{part}" for part in text.split(",")]
    return replace(PAINT, style=StyleConfig.parse(",".join(parts)), **fields)


def picture_of(scene, config):
    return bg.paint(scene, config, camera=CAMERA).rgb


def test_a_share_of_0_is_the_painting_without_style_bit_for_bit(scene, folder):
    plain = picture_of(scene, PAINT)
    np.testing.assert_array_equal(picture_of(scene, config_of("negative.style:0", folder)), plain)


def test_an_affine_style_is_the_same_map_of_the_picture(scene, folder):
    plain = picture_of(scene, PAINT)
    found = picture_of(scene, config_of("negative.style", folder))
    # Strokes that were beyond 0 to 1 are clipped at the other end.
    assert np.abs(found - (1 - plain)).mean() < 2e-3


def test_the_dial_and_the_mix_are_linear(scene, folder):
    plain, whole = picture_of(scene, PAINT), picture_of(scene, config_of("dimmed.style", folder))
    for share in (0.25, 0.6):
        found = picture_of(scene, config_of(f"dimmed.style:{share}", folder))
        np.testing.assert_allclose(
            found, plain + share * (whole - plain), atol=6e-3
        )  # highlights are clipped
    negative = picture_of(scene, config_of("negative.style", folder))
    found = picture_of(scene, config_of("dimmed.style:0.5,negative.style:0.25", folder))
    mixed = plain + 0.5 * (whole - plain) + 0.25 * (negative - plain)
    assert np.abs(found - mixed).mean() < 2e-3


def test_an_edit_changes_sizes_in_its_share(scene, folder):
    report = Report()
    plain = prepare(scene, PAINT, report, views=CAMERA).strokes
    half = prepare(scene, config_of("larger.style:0.5", folder), Report(), views=CAMERA).strokes
    np.testing.assert_allclose(half.scales, plain.scales * np.exp(0.25), rtol=1e-5)


def test_another_style_is_not_resumed(scene, folder, tmp_path):
    bg.save(scene, tmp_path / "scene.ply")
    frames, path = tmp_path / "frames/", PathConfig(orbit=3)
    paint_sequence(tmp_path / "scene.ply", frames, path, config_of("negative.style", folder))
    with pytest.raises(SceneError, match="style"):
        paint_sequence(
            tmp_path / "scene.ply",
            frames,
            path,
            config_of("dimmed.style", folder),
            SequenceConfig(is_resumed=True),
        )


def test_the_command_line_says_the_same(scene, folder, tmp_path):
    bg.save(scene, tmp_path / "scene.ply")
    words = ["render", str(tmp_path / "scene.ply"), "--look", "plain", "--strokes", "100", "--quiet"]
    words += ["--size", "48x36", "--azimuth", "20", "--see", "off"]
    style = f"{folder}/negative.style:70%"
    output = str(tmp_path / "a.png")
    assert main([*words, "--style", style, "--adjust", "contrast=1.2,brightness=-5%", "-o", output]) == 0
    assert main([*words, "-o", str(tmp_path / "plain.png")]) == 0
    found, plain = read_image(tmp_path / "a.png"), read_image(tmp_path / "plain.png")
    assert np.abs(found - plain).max() > 0.2


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--style", "none.style"], "none.style: "),
        (["--style", "a.style:1.4"], "--style must have shares of 0 to 1, got 1.4; for 1.4 % write 0.014"),
        (
            ["--style", "a.style:0.7,b.style:0.4"],
            "--style must have shares that add up to at most 1, got 1.1",
        ),
        (["--style", ""], "--style must be FILE:SHARE"),
        (["--adjust", "saturation"], "--adjust must be brightness, contrast, saturation, temperature"),
        (["--adjust", "contrast=7"], "contrast must be 0 to 3, got 7"),
        (["--swap", "#123:#456"], "--swap must be two colours such as"),
        (["--direction", "style"], "direction style needs --style"),
    ],
)
def test_what_cannot_be_gets_one_sentence(scene, tmp_path, capsys, words, sentence):
    bg.save(scene, tmp_path / "scene.ply")
    assert main(["render", str(tmp_path / "scene.ply"), "-o", str(tmp_path / "a.png"), *words]) == 2
    assert sentence in capsys.readouterr().err
    assert not (tmp_path / "a.png").exists()
