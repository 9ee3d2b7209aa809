import numpy as np
import pytest

import brushgs as bg
from brushgs.still_life import still_life, still_life_camera
from brushgs.still_life.light import TO_LAMP, Blockers, fit_views, lamp_visibility, view_dome
from brushgs.still_life.surfaces import revolve, sheet, smooth, sphere, tube, turn, unit
from brushgs.values.quats import rotation_matrices
from brushgs.values.sh import sh_basis


@pytest.fixture(scope="module")
def scene():
    return still_life()


def colors_from(gaussians, eye):
    basis = sh_basis(unit(gaussians.means - np.asarray(eye)), 3)
    return np.maximum(0, 0.5 + np.einsum("nk,nkc->nc", basis, gaussians.sh))


def test_it_has_the_size_and_the_degree_of_a_small_trained_scene(scene):
    assert 40_000 < len(scene) < 60_000
    assert scene.sh_degree == 3
    assert scene.means.dtype == np.float32
    assert np.count_nonzero(scene.sh[:, 9:].any(axis=(1, 2))) > 5000


def test_equal_seeds_give_equal_scenes_and_others_do_not():
    one, same, other = still_life(3000, seed=1), still_life(3000, seed=1), still_life(3000, seed=2)
    for name in ("means", "quats", "scales", "opacities", "sh"):
        np.testing.assert_array_equal(getattr(one, name), getattr(same, name))
    assert len(one) != len(other) or not np.array_equal(one.sh, other.sh)


def test_its_gaussians_are_flat_and_lie_in_their_surface(scene):
    scales = np.sort(scene.scales, axis=1)
    assert np.median(scales[:, 0] / scales[:, 1]) < 0.3
    on_table = (np.abs(scene.means[:, 1]) < 1e-6) & (scene.means[:, 2] < -3)
    assert np.count_nonzero(on_table) > 500
    normals = rotation_matrices(scene.quats[on_table])[:, :, 2]
    np.testing.assert_allclose(np.abs(normals[:, 1]), 1, atol=1e-5)


def test_it_has_needles_and_a_nearly_black_object(scene):
    scales = np.sort(scene.scales, axis=1)
    assert np.count_nonzero(scales[:, 2] > 100 * scales[:, 1]) >= 4
    colors = colors_from(scene, still_life_camera().position)
    bottle = (np.hypot(scene.means[:, 0] - 0.2, scene.means[:, 2] - 2.25) < 0.6) & (scene.means[:, 1] < -1.7)
    assert np.count_nonzero(bottle & (colors.max(axis=1) < 0.12)) > 500


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


def test_a_revolved_profile_is_covered_evenly_by_area():
    radii = np.linspace(0, 1, 64)
    cone = revolve(np.stack([radii, 0 * radii], axis=1), 4000)  # a disc
    radii = np.hypot(cone.points[:, 0], cone.points[:, 2])
    assert np.mean(radii < np.sqrt(0.5)) == pytest.approx(0.5, abs=0.02)
    np.testing.assert_allclose(cone.spacing**2 * 4000, np.pi, rtol=1e-9)


def test_normals_of_a_ball_point_outward():
    ball = sphere(2.0, 500)
    np.testing.assert_allclose(np.linalg.norm(ball.points, axis=1), 2.0, rtol=2e-3)
    np.testing.assert_allclose((ball.normals * unit(ball.points)).sum(axis=1), 1.0, atol=2e-3)


def test_a_tube_keeps_its_radius_and_runs_along_its_curve():
    curve = np.stack([np.linspace(0, 3, 30), np.zeros(30), np.zeros(30)], axis=1)
    pipe = tube(curve, np.full(30, 0.25), 400)
    np.testing.assert_allclose(np.hypot(pipe.points[:, 1], pipe.points[:, 2]), 0.25, rtol=1e-6)
    np.testing.assert_allclose(pipe.tangents, np.tile([1.0, 0, 0], (400, 1)), atol=1e-9)


def test_a_sheet_follows_its_height_and_its_normals_point_up():
    ramp = sheet((0, 0), (2, 1), lambda x, z: 0.5 * x, 300)
    np.testing.assert_allclose(ramp.points[:, 1], -0.5 * ramp.points[:, 0])
    np.testing.assert_allclose(ramp.normals, np.tile(unit([-0.5, -1, 0]), (300, 1)), atol=1e-9)


def test_a_smooth_curve_passes_through_its_control_points():
    controls = np.array([[0.0, 0], [1, 2], [3, 1], [4, 4]])
    curve = smooth(controls, 301)
    for point in controls:
        assert np.linalg.norm(curve - point, axis=1).min() < 0.02


def test_turn_is_a_rotation_by_the_right_hand():
    np.testing.assert_allclose(turn((0, 0, 2), np.pi / 2) @ (1, 0, 0), (0, 1, 0), atol=1e-12)


def test_a_ball_shades_what_lies_behind_it_but_not_itself():
    ball = Blockers(np.zeros((1, 3)), np.ones((1, 3)), np.array([7]), np.ones((1, 3)))
    points = np.stack([-3 * TO_LAMP, -3 * TO_LAMP, 3 * TO_LAMP, -3 * TO_LAMP + (0, 0, 4.0)])
    visible = lamp_visibility(points, np.array([0, 7, 0, 0]), ball)
    np.testing.assert_allclose(visible, [0, 1, 1, 1], atol=1e-6)


def test_the_fit_gives_back_a_function_of_degree_three():
    dome = view_dome()
    truth = np.random.default_rng(0).normal(0, 0.05, (4, 16, 3))
    colors = 0.5 + np.einsum("vk,nkc->vnc", sh_basis(-dome, 3), truth)
    fitted = fit_views(colors, dome)
    again = 0.5 + np.einsum("vk,nkc->vnc", sh_basis(-dome, 3), fitted)
    # The ridge that keeps unseen views tame costs this much; without it the fit is exact to 1e-12.
    assert np.abs(again - colors).max() < 0.02
