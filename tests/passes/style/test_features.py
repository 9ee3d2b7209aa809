"""Features of strokes mean the same in every scene."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.cameras.framing import plain_first_view, with_up
from brushgs.passes.style import features
from brushgs.passes.style.features import FEATURES, stroke_features
from brushgs.values.camera import FirstView
from brushgs.values.sh import sh_rotation
from tests.kit.for_each import for_each
from tests.passes.motion.scenes import moved
from tests.passes.scenes import random_gaussians, replaced
from tests.scenes import still_life_of

VIEW = FirstView(np.array([[-1.0, -1, -1], [1, 1, 1]]), np.array([0.0, 0, 1]), 0.0, 0.0)


def of(gaussians, name, view=VIEW):
    return stroke_features(gaussians, view, [name]).values[:, 0]


def transformed(gaussians, view, *, turn=0.0, factor=1.0, shift=(0.0, 0.0, 0.0)):
    """A scene and its first view in another unit, turned about up (z) and moved."""
    cos, sin = np.cos(turn), np.sin(turn)
    matrix = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1.0]])
    quat = np.array([np.cos(turn / 2), 0, 0, np.sin(turn / 2)])
    sh = np.einsum("ij,njc->nic", sh_rotation(matrix, gaussians.sh_degree), gaussians.sh)
    other = moved(replaced(gaussians, sh=sh), quat, shift, size=factor)
    return other, replace(view, points=factor * view.points @ matrix.T + shift)


@for_each("name", sorted(set(FEATURES) - {"visible"}))
@for_each("change", [{"factor": 1e-3}, {"factor": 1e4}, {"turn": 1.1}, {"shift": (5.0, -7.0, 2.0)}])
def test_features_depend_neither_on_unit_nor_place_nor_turn(name, change):
    scene = random_gaussians(400, terms=4)
    other, view = transformed(scene, VIEW, **change)
    np.testing.assert_allclose(of(other, name, view), of(scene, name), atol=1e-7)


def test_features_are_bounded_whatever_lies_far_away_or_shines():
    scene = random_gaussians(200, terms=16, spread=1e3, size=10.0)
    found = stroke_features(replaced(scene, sh=100 * scene.sh), VIEW)
    assert np.isfinite(found.values).all()
    for name, low, high in [
        ("height", features.LOWEST, features.HIGHEST),
        ("distance", 0, features.FARTHEST),
        ("gloss", 0, features.MOST_GLOSS),
        *((n, 0, 1) for n in ("size", "elongation", "flatness", "level", "bend", "visible", "contrast")),
    ]:
        column = found.columns((name,))
        assert low <= column.min() <= column.max() <= high, name


def test_height_runs_from_the_foot_of_the_subject_to_its_top():
    scene = replaced(random_gaussians(3), means=np.array([[9.0, 0, -1], [0, 9, 1], [0, 0, 0.0]]))
    np.testing.assert_allclose(of(scene, "height"), [0, 1, 0.5])
    np.testing.assert_allclose(of(scene, "height", with_up(VIEW, "-z")), [1, 0, 0.5])


def test_a_disc_is_flat_and_level_and_a_needle_is_long():
    scales = np.array([[1.0, 1, 1e-3], [1, 1e-3, 1e-3]])
    scene = replaced(random_gaussians(2), scales=scales, quats=np.array([[1.0, 0, 0, 0]] * 2))
    np.testing.assert_allclose(of(scene, "flatness"), [0.999, 0])
    np.testing.assert_allclose(of(scene, "elongation"), [0, 0.999])
    np.testing.assert_allclose(of(scene, "level")[0], 1)


def test_only_what_is_asked_for_comes_in_that_order():
    scene = still_life_of(1000)
    view = plain_first_view(scene)
    every = stroke_features(scene, view)
    assert every.names == tuple(FEATURES)
    some = stroke_features(scene, view, ["height", "lightness"])
    assert some.names == ("height", "lightness")
    np.testing.assert_array_equal(some.values, every.columns(("height", "lightness")))
    np.testing.assert_array_equal(every.take(slice(3, 7)).values, every.values[3:7])
    unseen = stroke_features(replaced(scene, opacities=0 * scene.opacities), view, ["size"]).values
    assert abs(unseen.mean() - 0.5) < 1e-9
    for few in (0, 1, 2):
        assert stroke_features(scene.take(slice(few)), view).values.shape == (few, len(FEATURES))
    with pytest.raises(ValueError, match=r"names must be of lightness, .* got 'mood'"):
        stroke_features(scene, view, ["mood"])
