import numpy as np
import pytest

import brushgs as bg
from brushgs.still_life import still_life, still_life_camera
from brushgs.still_life.light import fit_views, view_dome
from brushgs.still_life.surfaces import unit
from brushgs.values.sh import sh_basis
from tests.scenes import still_life_of


@pytest.fixture(scope="module")
def scene():
    return still_life_of()


def colors_from(gaussians, eye):
    basis = sh_basis(unit(gaussians.means - np.asarray(eye)), 3)
    return np.maximum(0, 0.5 + np.einsum("nk,nkc->nc", basis, gaussians.sh))


def test_it_has_the_size_and_the_degree_of_a_small_trained_scene(scene):
    assert 40_000 < len(scene) < 60_000
    assert scene.sh_degree == 3
    assert scene.means.dtype == np.float32
    assert np.count_nonzero(scene.sh[:, 9:].any(axis=(1, 2))) > 5000


def test_equal_seeds_give_equal_scenes_and_others_do_not():
    one, same, other = still_life(1000, seed=1), still_life(1000, seed=1), still_life(1000, seed=2)
    for name in ("means", "quats", "scales", "opacities", "sh"):
        np.testing.assert_array_equal(getattr(one, name), getattr(same, name))
    assert len(one) != len(other) or not np.array_equal(one.sh, other.sh)


def test_highlights_move_with_the_viewer(scene):
    front, left = colors_from(scene, (0, -3, -10)), colors_from(scene, (-10, -3, 0))
    change = np.abs(front - left).max(axis=1)
    assert np.count_nonzero(change > 0.15) > 500
    assert np.count_nonzero(change < 1e-4) > 10_000  # cloth and wall are matt


def test_it_fills_its_own_picture(scene):
    camera = still_life_camera(width=200, height=150)
    frame = bg.render(scene, camera, bg.StrokeTexture.open("gaussian"))
    assert frame.alpha.min() > 0.9
    assert frame.alpha.mean() > 0.99
    assert frame.rgb.min() < 0.1
    assert frame.rgb.max() > 0.8


def test_too_few_gaussians_are_refused():
    with pytest.raises(ValueError, match="at least 1000, got 999"):
        still_life(999)


def test_the_fit_gives_back_a_function_of_degree_three():
    dome = view_dome()
    truth = np.random.default_rng(0).normal(0, 0.05, (4, 16, 3))
    colors = 0.5 + np.einsum("vk,nkc->vnc", sh_basis(-dome, 3), truth)
    fitted = fit_views(colors, dome)
    again = 0.5 + np.einsum("vk,nkc->vnc", sh_basis(-dome, 3), fitted)
    # The ridge that keeps unseen views tame costs this much; without it the fit is exact to 1e-12.
    assert np.abs(again - colors).max() < 0.02
