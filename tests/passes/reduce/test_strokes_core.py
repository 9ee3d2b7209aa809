"""Floaters, the worth of strokes and solid paint: the core against NumPy twins, in any number of threads."""

import math
from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.core.native import core as _core
from brushgs.passes.form.solid import solidify
from brushgs.passes.reduce.clean import find_floaters
from brushgs.passes.reduce.worth import worth_keeping
from brushgs.rendering.constants import MIN_ALPHA, MIN_TRANSMITTANCE
from tests.doctor.scenes import ball, fruit
from tests.kit.for_each import for_each
from tests.passes.form.test_solid import joined, layer
from tests.passes.reduce import floaters_twin, worth_twin
from tests.passes.reduce.test_floaters import blobs
from tests.passes.scenes import random_gaussians, replaced, strange_strokes
from tests.passes.test_moments import SCALARS, with_threads

STRANGE = strange_strokes()
AROUND = np.random.default_rng(3).normal(size=(300, 3)) * [2, 2, 2]
FLOATING = {
    "fruit": fruit(),
    "specks around a ball": joined(ball(), blobs(AROUND, 0.03, 0.3), blobs((0, 0, 1.1), 0.003)),
    "faint": joined(
        replaced(ball(), opacities=np.float32(0.02) * ball().opacities), blobs(AROUND, 0.03, 0.02)
    ),
    "a cloud": random_gaussians(400, size=0.01),
}


@for_each("name", FLOATING)
@for_each("dtype", SCALARS)
def test_floaters_are_those_of_the_twin(name, dtype):
    scene = FLOATING[name].astype(dtype)
    gaps, areas, has_bodies = floaters_twin.measure_detachment(scene)
    found = find_floaters(scene)
    assert found.has_bodies == has_bodies
    for level, gap in ((found.sure, floaters_twin.SURE_GAP), (found.strong, floaters_twin.STRONG_GAP)):
        is_far = (gaps > gap) & has_bodies
        np.testing.assert_array_equal(level.rows, is_far)
        np.testing.assert_allclose(level.share, areas[is_far].sum() / areas.sum(), rtol=1e-12)
        np.testing.assert_allclose(level.nearest, gaps[is_far].min(initial=np.inf), rtol=1e-12)


def test_the_scenes_of_the_twin_have_floaters_and_bodies():
    found = {name: find_floaters(scene) for name, scene in FLOATING.items()}
    assert found["specks around a ball"].sure.rows.sum() > 100
    assert found["specks around a ball"].strong.rows.sum() > found["specks around a ball"].sure.rows.sum()
    assert found["faint"].is_haze
    assert not found["a cloud"].has_bodies


def test_copies_that_count_follow_from_what_the_renderer_sees():
    assert math.ceil(math.log(MIN_TRANSMITTANCE) / math.log1p(-MIN_ALPHA)) == _core.MOST_COPIES


def strokes_to_judge():
    """Walls, veils, fog and specks in one scene, seen in the opacities of a trained one."""
    rng = np.random.default_rng(5)
    wall = joined(*(layer(5, opacity=0.5, size=0.7, z=0.1 * k) for k in range(2)))
    places = rng.uniform(-3, 8, (100, 3)) * np.where(np.arange(100) % 3, 1, 5)[:, None]
    sizes = rng.uniform(0.05, 2, (100, 3))
    opacities = 0.7 * rng.uniform(0, 1, 100) ** 3
    return joined(wall, *(blobs(*one) for one in zip(places, sizes, opacities, strict=True)))


JUDGED = STRANGE | {"walls and fog": strokes_to_judge()}


@pytest.mark.filterwarnings("ignore:overflow", "ignore:invalid value", "ignore:divide by zero")
@for_each("name", JUDGED)
@for_each("dtype", SCALARS)
def test_strokes_worth_keeping_are_those_of_the_twin(name, dtype):
    strokes = JUDGED[name].astype(dtype)
    found = with_threads(lambda: [worth_keeping(strokes)])[0]
    np.testing.assert_array_equal(found, worth_twin.worth_keeping(strokes))
    if name == "walls and fog":
        assert 10 < (~found).sum() < 100


@pytest.mark.filterwarnings("ignore:overflow", "ignore:invalid value", "ignore:divide by zero")
@for_each("name", JUDGED)
@for_each("finest", [0.0, 0.2])
def test_solid_strokes_are_those_of_the_twin(name, finest):
    strokes = replace(JUDGED[name], finest=finest)
    solid = solidify(strokes, 0.7)
    if not len(strokes):
        return
    scales, opacities = worth_twin.solidified(strokes, 0.7)
    # Of needles seen end-on all digits but four cancel.
    rtol = 1e-6 if name == "needles" else 1e-9
    np.testing.assert_allclose(solid.scales, scales, rtol=rtol)
    np.testing.assert_allclose(solid.opacities, opacities, rtol=rtol)


def test_light_passes_by_what_is_alone_and_not_through_what_is_covered():
    """Opacity grows by the light that is stopped, o + s o (1 - o): to two coats over another stroke."""
    over = bg.solidify(joined(layer(opacity=1.0, size=1.0), layer(1, opacity=0.5, z=0.01)))
    assert over.opacities[-1] == pytest.approx(0.75)
    assert bg.solidify(layer(1, opacity=0.5)).opacities[0] == pytest.approx(0.5 + 0.5 * 0.25)
