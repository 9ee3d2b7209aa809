"""Drawings in charcoal: four masses, lights, pressed lines, and a stage that sets off its subject."""

import numpy as np
import pytest

import brushgs as bg
from brushgs.options.look_parts import ColorConfig
from brushgs.options.media import Charcoal
from brushgs.pipeline.media.materials import Materials
from brushgs.pipeline.media.motif import Motif
from brushgs.pipeline.media.squinting import value_errors
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.rendering.options import RenderOptions
from brushgs.still_life import still_life_camera
from brushgs.values.sh import C0
from tests.kit import blind, still_life_of

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


def test_lights_are_taken_out_and_chalk_lies_on_toned_paper_alone(drawn):
    names = [one.name for one in drawn.painting.coats]
    assert names.index("marks") < names.index("rubber") < names.index("chalk") < names.index("lines")
    white = config_of(ground={"ground": "#ffffff"})
    others = prepare(SCENE, white, Report(), views=CAMERA).painting.coats
    assert "chalk" not in {one.name for one in others}


def test_a_frame_depends_on_its_view_alone(drawn, picture):
    other = bg.Camera.look_at((1, -1, -4), (0, 0, 0), width=SIZE[0], height=SIZE[1])
    drawn.painting.frame(other)
    np.testing.assert_array_equal(drawn.painting.frame(CAMERA).rgb, picture.rgb)


def test_value_errors_are_what_masses_lack_to_a_line_of_those_of_the_scene():
    """Three soft bands that fill a picture; one drawing has them as they are, one its middle one too dark."""
    camera = bg.Camera.look_at((0, 0, -5), (0, 0, 0), width=120, height=60)

    def bands(*greys):
        sh = (np.array(greys)[:, None, None].repeat(3, axis=2) - 0.5) / C0
        means, scales = np.array([(-3.5, 0, 0), (0, 0, 0), (3.5, 0, 0)]), np.tile([1.9, 9, 0.1], (3, 1))
        return bg.Gaussians(means, np.tile([1.0, 0, 0, 0], (3, 1)), scales, np.ones(3), sh)

    kernel, scene = bg.StrokeTexture.open("gaussian"), bands(0.1, 0.5, 0.6)
    options = RenderOptions.of(kernel)
    materials = Materials(scene, kernel, options, Charcoal(), ColorConfig(), None, cameras=[camera])
    as_it_is, found = value_errors(materials, [materials.smudge("as it is", scene)], 40)
    assert abs(as_it_is).max() < 0.01
    (left, middle, right), _ = value_errors(materials, [materials.smudge("dark", bands(0.1, 0.2, 0.6))], 40)
    assert middle > 0.05
    assert max(left, right) < 0
    opened, _ = value_errors(materials, [materials.smudge("as it is", scene)], 1.2 * found)
    assert opened[0] < opened[1] < -0.01 < opened[2]  # the darks get darker, the lights stay


def test_a_lamp_leaves_the_scene_as_many_of_its_values_as_they_are_to_keep():
    views, weight = bg.plain_views(SCENE, [CAMERA]), np.ones((4, 8))
    plain, lit = np.random.default_rng(0).random((2, 4, 8))
    for key, least in ((0.35, 0.94), (0.7, 0.79)):
        held = Motif.of(views, key, 1).held(lit, plain, weight)
        assert least < np.corrcoef(held.ravel(), plain.ravel())[0, 1] < least + 0.02
        np.testing.assert_allclose([held.mean(), held.std()], [lit.mean(), lit.std()])
    near = plain + 1e-3 * lit
    np.testing.assert_array_equal(Motif.of(views, 0.35, 1).held(near, plain, weight), near)
