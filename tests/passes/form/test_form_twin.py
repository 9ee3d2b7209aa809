"""Strokes turned along the form: the core against NumPy."""

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats.guides import Guides
from brushgs.passes.form import orient
from brushgs.passes.form.mark_directions import Marks
from brushgs.passes.form.neighborhood import Neighborhood
from tests.kit.for_each import for_each
from tests.passes.form import form_twin
from tests.passes.form.planks import planks, turned_frame
from tests.passes.scenes import random_gaussians, strange_strokes
from tests.scenes import still_life_of

ABOVE = bg.Camera.look_at((0, 0, -5), (0, 0, 0), width=64, height=48)
MARKS = np.stack([np.full((48, 64), 0.3), np.linspace(-0.6, 0.6, 48 * 64).reshape(48, 64)], axis=-1)
FIELDS = {
    "form": "form",
    "color": "color",
    "guides": Guides(np.zeros((1, 3)), np.ones((1, 3)), None),
    "marks": Marks(ABOVE, MARKS),
    "marks of a style": Marks(ABOVE, MARKS, 5.0),
}


def fruit():
    scene = still_life_of(4000)
    return bg.cluster(scene, 500), scene


SCENES = {"planks": lambda: planks(frame=turned_frame()), "fruit": fruit}
SCENES["a cloud"] = lambda: (random_gaussians(200), random_gaussians(900))
SCENES["few"] = lambda: (random_gaussians(3), random_gaussians(2))


@for_each("scene", SCENES)
@for_each("name", FIELDS)
@for_each("dtype", [np.float32, np.float64])
def test_strokes_are_turned_as_by_the_twin(scene, name, dtype):
    strokes, gaussians = (some.astype(dtype) for some in SCENES[scene]())
    found = bg.orient(strokes, gaussians, FIELDS[name])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(orient, "Neighborhood", form_twin.Neighborhood)
        expected = bg.orient(strokes, gaussians, FIELDS[name])
    tolerance = 2e-6 if dtype == np.float32 else 1e-9
    np.testing.assert_allclose(found.scales, expected.scales, rtol=tolerance)
    np.testing.assert_allclose(found.quats, expected.quats, rtol=0, atol=tolerance)
    assert not np.array_equal(found.quats, strokes.quats)


@for_each("name", strange_strokes())
def test_fields_and_means_are_those_of_the_twin(name):
    strokes = strange_strokes()[name].astype(np.float64)
    if not len(strokes):
        return
    core, twin = Neighborhood(strokes), form_twin.Neighborhood(strokes)
    for by_color_alone in (False, True):
        found, expected = (one.field(strokes, by_color_alone=by_color_alone) for one in (core, twin))
        np.testing.assert_allclose(found[0], expected[0], atol=1e-6)
        np.testing.assert_allclose(found[1], expected[1], atol=1e-6)
    values = np.random.default_rng(0).normal(size=(len(strokes), 6))
    np.testing.assert_allclose(core.smoothed(values), twin.smoothed(values), rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(core.agreed(values[:, :3]), twin.agreed(values[:, :3]))
