"""Watercolour: what it is without its effect, and films."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.options.sequence import PathConfig
from brushgs.pipeline.clip import Clip
from brushgs.pipeline.prepare import PICTURE, prepare
from brushgs.pipeline.report import Report
from brushgs.rendering.effect import without_effect
from brushgs.still_life import still_life_camera
from tests.kit import blind, still_life_of

SIZE = 240, 180
CAMERA = still_life_camera(width=SIZE[0], height=SIZE[1])


@pytest.fixture(scope="module")
def prepared():
    config = blind("watercolour", 3000, SIZE)
    return prepare(still_life_of(6000), config, Report(), views=CAMERA, asks=PICTURE)


def test_without_its_effect_a_wash_is_soft_paint_to_the_bit(prepared):
    (wash,) = (coat for coat in prepared.painting.coats if coat.name == "wash")
    bare = replace(prepared.painting, coats=(replace(wash, effect=None),), surface=None)
    expected = bg.render(wash.strokes, CAMERA, "gaussian")
    assert np.array_equal(bare.frame(CAMERA).rgb, expected.rgb)
    keyed = without_effect(wash)
    assert keyed.effect is None
    assert keyed.strokes.sh.shape[1] == 1


@pytest.fixture(scope="module")
def film():
    config = blind("watercolour", 3000, SIZE)
    return prepare(still_life_of(6000), config, Report(), views=PathConfig(orbit=4), asks=PICTURE)


def test_where_the_camera_moves_outlines_are_half_lost_and_washes_run_off_the_sheet(prepared, film):
    for one, losing, has_border in ((prepared, 1, True), (film, 0.5, False)):
        coats = {coat.name: coat for coat in one.painting.coats}
        assert coats["wash"].effect.losing == losing
        assert coats["wash"].effect.has_border is has_border
        assert bool(coats["touches"].border) is has_border


def test_washes_of_a_scene_that_moves_before_a_camera_at_rest_keep_their_border(prepared):
    config = blind("watercolour", 500, SIZE)
    scene = still_life_of(1000)
    clip = Clip(bg.MovingScene(0.5, True, lambda time: scene), bg.ClipConfig(fps=8))
    painting = prepare(clip, config, Report(), views=CAMERA, asks=PICTURE).painting
    (layer,) = (coat.effect for coat in painting.coats if coat.name == "wash")
    assert layer.has_border
    assert layer.losing == 0.5


def test_paper_takes_less_hold_of_washes_in_films(prepared, film):
    def grain(painting):
        wash = painting.coats[[coat.name for coat in painting.coats].index("wash")]
        sheet = replace(painting.surface.seen_in(CAMERA, None), recipe=None)
        pictures = [
            replace(painting, coats=(wash,), surface=one).frame(CAMERA).rgb
            for one in (sheet, replace(sheet, grain=np.full_like(sheet.grain, 0.5)))
        ]
        return np.abs(np.subtract(*pictures)).mean()

    assert 0 < grain(film.painting) < 0.5 * grain(prepared.painting)
