"""The factor on the strokes per area of each Gaussian, for a sphere, the subject and a mask."""

from pathlib import Path

import numpy as np
import pytest

from brushgs.cameras.framing import plain_first_view
from brushgs.options.focus import Focus
from brushgs.passes.reduce.focus import (
    AUTO_STRENGTH,
    EDGE,
    LEAST,
    STRENGTH,
    auto_focus,
    contrast,
    mask_focus,
    painted_focus,
    sphere_focus,
    subject_focus,
)
from brushgs.values.camera import Camera, FirstView
from brushgs.values.marks import Density
from tests.passes.scenes import gaussians_at, grid
from tests.scenes import still_life_of

CAMERA = Camera.look_at((0, 0, -4), (0, 0, 0), width=40, height=30)


def dots(means, opacity=0.99, scale=0.05):
    return gaussians_at(means, scale, opacity=opacity, dtype=np.float32)


def test_a_sphere_is_full_inside_and_falls_smoothly_across_its_surface_in_any_unit():
    line = np.column_stack([np.linspace(0, 2, 2001), np.zeros((2001, 2))])
    found = sphere_focus(dots(1 + line), (1, 1, 1), 1.0)
    away = line[:, 0]
    np.testing.assert_allclose(found[away < 1 - EDGE], STRENGTH, atol=1e-6)
    np.testing.assert_allclose(found[away > 1 + EDGE], 1, atol=1e-6)
    assert found[1000] == pytest.approx(0.5 * (1 + STRENGTH), abs=1e-3)
    assert -0.01 < np.diff(found).min() <= np.diff(found).max() <= 0
    large = sphere_focus(dots(1e4 * (1 + line)), (1e4, 1e4, 1e4), 1e4)
    np.testing.assert_allclose(large, found, atol=1e-3)


def test_painted_balls_are_spheres_of_any_factor_that_do_not_multiply_where_they_overlap():
    line = dots(np.column_stack([np.linspace(-3, 3, 601), np.zeros((601, 2))]))

    def painted(*balls):
        rows = np.array(balls, np.float64)
        return painted_focus(line, Density(rows[:, :3], rows[:, 3], rows[:, 4]))

    twice = painted([0, 0, 0, 1, STRENGTH])
    np.testing.assert_allclose(twice, sphere_focus(line, (0, 0, 0), 1.0))
    np.testing.assert_array_equal(painted([0, 0, 0, 1, STRENGTH], [0, 0, 0, 1, STRENGTH]), twice)
    mixed = painted([0, 0, 0, 2, 4], [1, 0, 0, 0.2, 0.5], [-1, 0, 0, 0.2, 0])
    assert mixed[[300, 400, 200, 0]].tolist() == [4, 2, LEAST, 1]


def test_the_subject_is_the_bounds_of_what_is_framed():
    corners = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0], [1.0, -1.0, 1.0]])
    view = FirstView(corners, np.array([0, -1.0, 0]), 0.0, 0.0, has_surroundings=True)
    found = subject_focus(dots([[0, 0, 0], [0.99, -0.99, 0.99], [5, 0, 0], [1.1, 0, 0]]), view)
    np.testing.assert_allclose(found[:3], [STRENGTH, STRENGTH, 1], atol=1e-6)
    assert 1 < found[3] < STRENGTH


def test_a_mask_lights_what_is_seen_under_it():
    mask = np.zeros((30, 40), np.float32)
    mask[:, 20:] = 1
    left, right, hidden, out = [-0.8, 0, 0], [0.8, 0, 0], [1.6, 0, 4], [50, 0, 0]
    wall = [[0.8 + dx, dy, -0.2] for dx in (-0.1, 0, 0.1) for dy in (-0.1, 0, 0.1)]
    found = mask_focus(dots([left, right, hidden, out, *wall], scale=0.1), CAMERA, mask)
    assert found[0] == found[3] == 1
    np.testing.assert_allclose(found[4:], STRENGTH, atol=1e-3)
    between = mask_focus(dots([[0, 0, 0]], scale=0.1), CAMERA, mask)
    np.testing.assert_allclose(between, 0.5 * (1 + STRENGTH), atol=0.02)


def test_what_is_hidden_from_the_first_view_or_behind_it_has_no_focus():
    everywhere = np.ones((30, 40), np.float32)
    found = mask_focus(dots([[0, 0, 3], *grid(9)], opacity=1.0, scale=0.3), CAMERA, everywhere)
    assert found[0] == 1
    assert found[1:].min() > 1.9
    np.testing.assert_array_equal(mask_focus(dots([[0, 0, -90]]), CAMERA, everywhere), [1.0])
    with pytest.raises(ValueError, match="picture must have shape"):
        mask_focus(dots([[0, 0, 0]]), CAMERA, everywhere[:4])


def test_a_focus_is_read_from_text():
    assert Focus.of("off") is None
    assert Focus.of("./auto") == Focus(mask=Path("auto"))
    ball = Focus((1.0, 2.0, 3.0, 0.5))
    for text, focus in (("auto", Focus(is_auto=True)), ("subject", Focus()), ("1,2,3,0.5", ball)):
        assert (Focus.of(text), str(focus)) == (focus, text)
    with pytest.raises(ValueError, match="focus must be one of"):
        Focus((1.0, 2.0, 3.0, 0.5), is_auto=True)


def test_auto_is_at_most_its_strength_and_leaves_one_color_alone():
    gaussians = still_life_of(3000)
    found = auto_focus(gaussians, plain_first_view(gaussians))
    assert 1 <= found.min() <= 2 < found.max() <= AUTO_STRENGTH
    assert (found > 2).mean() < 0.3
    same = dots(gaussians.means)
    assert contrast(auto_focus(same, plain_first_view(same))) < 1.02
