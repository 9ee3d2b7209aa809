"""Drawings in charcoal: four masses, lights, pressed lines, and a stage that sets off its subject."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.options.look import Look
from brushgs.options.painting import ViewConfig
from brushgs.passes.color.squint import Squint, squinted
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.rendering.plain import plain_views
from brushgs.still_life import still_life_camera
from brushgs.values.sh import base_colors, in_colors
from tests.scenes import still_life_of

SIZE = 240, 180
SCENE = still_life_of(4000)
CAMERA = still_life_camera(width=SIZE[0], height=SIZE[1])


def config_of(look="charcoal", num_strokes=900, **color):
    config = Look.open(look).config
    return replace(
        config,
        strokes=replace(config.strokes, see="off"),
        cluster=replace(config.cluster, strokes=num_strokes),
        color=replace(config.color, **color),
        view=ViewConfig(size=SIZE),
    )


@pytest.fixture(scope="module")
def drawn():
    return prepare(SCENE, config_of(), Report(), views=CAMERA)


@pytest.fixture(scope="module")
def picture(drawn):
    return drawn.painting.frame(CAMERA)


def coat(drawn, name):
    return next(one for one in drawn.painting.coats if one.name == name)


def test_the_picture_has_the_range_of_a_drawing_and_the_masses_of_the_scene(picture):
    """A range of 63, and a correlation of 0.70 with these few strokes; of captured scenes 0.78 to 0.96."""
    plain = plain_views(SCENE, [CAMERA]).frames[0]
    subject = plain.alpha > 0.5
    seen = Squint.of(picture.rgb, plain.alpha)
    assert seen.range >= 40
    straight = np.clip(plain.straight_colors(), 0, 1)
    light = Squint.of(straight, plain.alpha).lab[..., 0]
    weight = np.maximum(squinted(subject.astype(float)), 1e-9)
    pairs = [squinted(subject * one)[subject] / weight[subject] for one in (light, seen.lab[..., 0])]
    assert np.corrcoef(*pairs)[0, 1] >= 0.68


def test_masses_have_four_values_in_the_shares_of_the_view(drawn):
    masses = coat(drawn, "masses")
    light = base_colors(masses.strokes.sh)[:, 0]
    values = np.sort(masses.effect.values)
    assert len(values) == 4
    paper, black = masses.effect.paper[0], masses.effect.black[0]
    shares = (light - paper) / (black - paper)
    nearest = np.abs(shares[:, None] - values).argmin(axis=1)
    assert set(nearest) == {0, 1, 2, 3}


def test_lines_are_three_times_as_heavy_in_the_dark_and_lost_in_the_light(drawn):
    from brushgs.passes.add.line_press import pressed

    lines = drawn.painting.coats[-1]
    assert lines.name == "lines"
    weights = np.sort(lines.strokes.scales, axis=1)[:, 1] * lines.strokes.opacities
    low, high = np.percentile(weights, (10, 90))
    assert high >= 3 * low
    shown = replace_lines(lines)
    assert len(pressed(shown, drawn.strokes, np.ones(len(drawn.strokes)))) == 0
    assert len(pressed(shown, drawn.strokes, np.zeros(len(drawn.strokes)))) == len(shown)


def replace_lines(lines):
    from brushgs.passes.add.lines import Lines

    count = len(lines.strokes)
    return Lines(lines.strokes, np.ones(count), np.arange(count) // 8, np.zeros((count, 3)))


def test_lights_are_taken_out_and_chalk_lies_on_toned_paper_alone(drawn):
    names = [one.name for one in drawn.painting.coats]
    assert names.index("marks") < names.index("rubber") < names.index("chalk") < names.index("lines")
    config = config_of()
    white = replace(config, ground=replace(config.ground, ground="#ffffff"))
    others = prepare(SCENE, white, Report(), views=CAMERA).painting.coats
    assert "chalk" not in {one.name for one in others}


def test_a_frame_alone_is_that_of_any_number_of_threads_and_depends_on_its_view_alone(drawn, picture):
    other = bg.Camera.look_at((1, -1, -4), (0, 0, 0), width=SIZE[0], height=SIZE[1])
    drawn.painting.frame(other)
    np.testing.assert_array_equal(drawn.painting.frame(CAMERA).rgb, picture.rgb)
    config = config_of()
    one = prepare(SCENE, replace(config, draw=replace(config.draw, threads=1)), Report(), views=CAMERA)
    np.testing.assert_array_equal(one.painting.frame(CAMERA).rgb, picture.rgb)


def test_one_stroke_is_drawn_by_its_own_tone():
    scene = SCENE.take([0])
    camera = bg.Camera.look_at(scene.means[0] + (0, 0, -2), scene.means[0], width=SIZE[0], height=SIZE[1])
    levels = []
    for grey in (0.05, 0.95):
        solid = replace(in_colors(scene, np.full(3, grey)), opacities=np.ones(1, np.float32))
        wide = replace(solid, scales=np.full((1, 3), 0.3, np.float32))
        frame = prepare(wide, config_of(num_strokes=None), Report(), views=camera).painting.frame(camera)
        assert np.isfinite(frame.rgb).all()
        levels.append(frame.rgb[80:100, 110:130].mean())
    assert levels[0] < 0.4 < levels[1]


@pytest.mark.parametrize("look", ["oil", "watercolour"])
def test_gray_takes_the_colour_out_of_any_look(look):
    """Only papers with their own light: the picture has no hue, and the lightness of the coloured one."""
    coloured = bg.paint(SCENE, config_of(look, 250), camera=CAMERA)
    grey = bg.paint(SCENE, config_of(look, 250, gray=True), camera=CAMERA)
    assert np.ptp(coloured.rgb, axis=2).mean() > 0.05
    assert np.ptp(grey.rgb, axis=2).max() < 0.02
    assert np.abs(squinted(grey.rgb.mean(axis=2)) - squinted(coloured.rgb.mean(axis=2))).mean() < 0.06
