"""Floaters, the worth of strokes and solid paint: the core against NumPy twins, in any number of threads."""

import math
from dataclasses import replace

import numpy as np
import pytest

from brushgs.core.native import core as _core
from brushgs.passes.form.solid import solidify
from brushgs.passes.reduce.clean import find_floaters
from brushgs.passes.reduce.worth import worth_keeping
from brushgs.rendering.constants import MIN_ALPHA, MIN_TRANSMITTANCE
from tests.doctor.scenes import ball, fruit
from tests.kit.for_each import for_each
from tests.passes.reduce import floaters_twin, worth_twin
from tests.passes.reduce.test_floaters import blobs, joined
from tests.passes.scenes import gaussians_at, grid, random_gaussians, replaced, strange_strokes
from tests.passes.test_moments import SCALARS, with_threads

STRANGE = strange_strokes()
AROUND = np.random.default_rng(3).normal(size=(300, 3)) * [2, 2, 2]
UPWARD = np.outer(1 + 0.05 * np.arange(40), (0, 1, 0))


def groups_around():
    """Small groups, some of haze, from one Gaussian to as many as a body has."""
    rng = np.random.default_rng(4)
    counts = (2 ** rng.uniform(0, 7, 90)).astype(int)
    for count, places in zip(counts, rng.uniform(-5, 5, (90, 3)), strict=True):
        yield blobs(places + 0.1 * rng.normal(size=(count, 3)), 0.04, rng.uniform(0.02, 0.9))


FLOATING = {
    "fruit": fruit(),
    "specks around a ball": joined(ball(), blobs(AROUND, 0.03, 0.3), blobs((0, 0, 1.1), 0.003)),
    "faint": joined(replaced(ball(), opacities=0.02 * ball().opacities), blobs(AROUND, 0.03, 0.02)),
    "groups around a ball": joined(ball(), *groups_around()),
    "a wire on a ball": joined(ball(), blobs(UPWARD, (0.004, 0.03, 0.004))),
    "a coarse wall beside a ball": joined(ball(), blobs(grid(16, 8.0, 9.0), (0.6, 0.6, 0.01))),
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
    specks = find_floaters(FLOATING["specks around a ball"])
    assert specks.strong.rows.sum() > specks.sure.rows.sum() > 100
    assert find_floaters(FLOATING["faint"]).is_haze
    assert not find_floaters(FLOATING["a cloud"]).has_bodies


def test_solid_by_nothing_is_the_input_itself_and_strengths_out_of_range_are_refused():
    strokes = random_gaussians(3)
    assert solidify(strokes, 0) is strokes
    for strength in (-0.1, 1.5, np.nan):
        with pytest.raises(ValueError, match=r"solidify: strength must be in \[0, 1\]"):
            solidify(strokes, strength)


def test_copies_that_count_follow_from_what_the_renderer_sees():
    assert math.ceil(math.log(MIN_TRANSMITTANCE) / math.log1p(-MIN_ALPHA)) == _core.MOST_COPIES


def strokes_to_judge():
    """Walls, veils, fog and specks in one scene, seen in the opacities of a trained one."""
    rng = np.random.default_rng(5)
    walls = (grid(5, 2.0, z) + np.array([2, 2, 0]) for z in (0.0, 0.1))
    wall = joined(*(gaussians_at(means, (0.7, 0.7, 0.007), opacity=0.5) for means in walls))
    places = rng.uniform(-3, 8, (100, 3)) * np.where(np.arange(100) % 3, 1, 5)[:, None]
    sizes = rng.uniform(0.05, 2, (100, 3))
    opacities = 0.5 * rng.uniform(0, 1, 100) ** 1.5
    rows = np.arange(40.0)
    veils = blobs(np.add((12, 3.5, 0), np.outer(rows, (0.01, 0, 0.001))), (0.9, 0.9, 0.01), 0.1)
    mast = blobs(np.add((3.5, 3.5, 0), np.outer(rows[:4], (0, 0, 2))), (0.02, 0.02, 0.8), 0.5)
    wire = blobs(np.add((0, 3.5, 30), np.outer(rows[:8], (2.5, 0, 0))), (0.8, 0.01, 0.01), 0.4)
    others = (blobs(*one) for one in zip(places, sizes, opacities, strict=True))
    return joined(wall, veils, mast, wire, *others)


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
