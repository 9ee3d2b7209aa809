"""Drawings in charcoal: four masses, lights, pressed lines, and a stage that sets off its subject."""

import numpy as np
import pytest

import brushgs as bg
from brushgs.passes.color.squint import Squint, squinted
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.rendering.plain import plain_views
from brushgs.still_life import still_life_camera
from brushgs.values.sh import base_colors
from tests.kit.configs import blind
from tests.scenes import still_life_of

SIZE = 240, 180
SCENE = still_life_of(4000)
CAMERA = still_life_camera(width=SIZE[0], height=SIZE[1])


def config_of(**steps):
    return blind("charcoal", 900, SIZE, **steps)


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


def test_lights_are_taken_out_and_chalk_lies_on_toned_paper_alone(drawn):
    names = [one.name for one in drawn.painting.coats]
    assert names.index("marks") < names.index("rubber") < names.index("chalk") < names.index("lines")
    white = config_of(ground={"ground": "#ffffff"})
    others = prepare(SCENE, white, Report(), views=CAMERA).painting.coats
    assert "chalk" not in {one.name for one in others}


def test_a_frame_alone_is_that_of_any_number_of_threads_and_depends_on_its_view_alone(drawn, picture):
    other = bg.Camera.look_at((1, -1, -4), (0, 0, 0), width=SIZE[0], height=SIZE[1])
    drawn.painting.frame(other)
    np.testing.assert_array_equal(drawn.painting.frame(CAMERA).rgb, picture.rgb)
    one = prepare(SCENE, config_of(draw={"threads": 1}), Report(), views=CAMERA)
    np.testing.assert_array_equal(one.painting.frame(CAMERA).rgb, picture.rgb)
