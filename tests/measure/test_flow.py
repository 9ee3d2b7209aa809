"""Flow of moving scenes: exact, so that a moving body is measured as a moving camera is."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.measure.flow import SceneFlow, displacements
from brushgs.measure.warp import View, match_views
from brushgs.still_life import still_life_camera
from brushgs.still_life.surfaces import turn
from brushgs.values.quats import quat_products, quats_of
from tests.kit.for_each import for_each
from tests.measure.warped import warp_error
from tests.scenes import still_life_of

KERNEL = bg.StrokeTexture.open("gaussian")
BLACK = (0.0, 0.0, 0.0)
CENTER = np.array([0.0, -1.0, 0.5])


@pytest.fixture(scope="module")
def body():
    """The still life without its highlights, which would stay where they are when it turns."""
    scene = still_life_of(20_000)
    return replace(scene, sh=scene.sh[:, :1].copy())


@pytest.fixture(scope="module")
def camera():
    return still_life_camera(width=240, height=180)


def placed(body, rotation, shift):
    means = (body.means - CENTER) @ rotation.T + CENTER + shift
    quats = quat_products(quats_of(rotation[None]), body.quats)
    return replace(body, means=means.astype(np.float32), quats=quats.astype(np.float32))


def view_of(scene, camera):
    frame = bg.render(scene, camera, KERNEL)
    return View(frame.over(BLACK), frame.depth, frame.alpha, camera)


def errors_of(body, camera, rotation, shift):
    """Of a body that moves, of one that rests before a camera that moves, and without the flow."""
    earlier = placed(body, rotation, shift)
    first, second = view_of(earlier, camera), view_of(body, camera)
    flow = displacements(body, earlier.means, camera)
    world = np.eye(4)
    world[:3, :3], world[:3, 3] = rotation, CENTER + shift - rotation @ CENTER
    around = bg.Camera(camera.viewmat @ world, camera.K, camera.width, camera.height)
    return (
        warp_error(first, second, displacement=flow),
        warp_error(view_of(body, around), second),
        warp_error(first, second),
    )


@for_each(
    ("rotation", "shift", "rel", "least"),
    [
        (np.eye(3), np.array([0.3, 0.0, 0.2]), 1e-3, 5),
        (turn((0.2, 1, 0.1), np.radians(3)), np.zeros(3), 0.05, 3),  # measured: 1.4 %
    ],
)
def test_a_body_that_moves_is_measured_as_a_camera_that_moves(body, camera, rotation, shift, rel, least):
    moved, still, without = errors_of(body, camera, rotation, shift)
    assert moved.rmse == pytest.approx(still.rmse, rel=rel)
    assert moved.valid_share == pytest.approx(still.valid_share, abs=5e-3)
    assert without.rmse > least * moved.rmse


def test_the_displacement_of_a_pixel_is_that_of_what_it_shows(body, camera):
    """The apple rises, the rest stays."""
    is_apple = np.linalg.norm(body.means - (0.45, -0.55, -0.95), axis=1) < 0.75
    is_apple &= body.means[:, 1] < -0.12
    means = body.means.copy()
    means[is_apple] -= (0, 0.25, 0)
    flow = displacements(body, means, camera)
    x, y, w = camera.K @ (camera.viewmat @ (0.45, -0.5, -1.4, 1))[:3]
    np.testing.assert_allclose(flow[int(y / w), int(x / w)], (0, -0.25, 0), atol=2e-3)
    assert np.abs(flow[:60, :60]).max() < 1e-6  # the wall
    np.testing.assert_array_equal(displacements(body, body.means, camera), np.zeros((180, 240, 3)))


def test_what_has_no_surface_has_no_displacement(camera):
    lone = bg.Gaussians([[0, -1, 0]], [[1, 0, 0, 0]], [[0.1] * 3], [0.9], [[[0.5] * 3]])
    flow = displacements(lone, lone.means + np.float32(1), camera)
    alpha = bg.render(lone, camera, KERNEL).alpha
    np.testing.assert_allclose(flow[alpha > 0.01], 1, atol=1e-4)
    assert not flow[alpha == 0].any()


def test_rows_that_do_not_correspond_are_refused(body, camera):
    with pytest.raises(ValueError, match=r"rows must correspond, got .* now and 3 before"):
        displacements(body, body.means[:3], camera)
    view = view_of(body, camera)
    with pytest.raises(ValueError, match="displacement"):
        match_views(view, view, np.zeros((3, 4, 3)))


def test_the_flow_at_a_mark_is_where_the_scene_went(body, camera):
    shift = np.array([0.2, -0.1, 0.3])
    earlier = placed(body, np.eye(3), shift)
    second = view_of(body, camera)
    aside = bg.Camera.look_at((0.9, -3.3, -10.2), (0.1, -1.4, 0.2), width=240, height=180, fov_y=0.5)
    flow = SceneFlow(aside, second, displacements(body, earlier.means, camera))
    now, before = (bg.project(s, c, num_sigmas=2.0) for s, c in ((body, camera), (earlier, aside)))
    _, i, j = np.intersect1d(before.ids, now.ids, return_indices=True)
    found, is_known = flow.at(now.centers[j], now.depths[j])
    assert 0.2 < is_known.mean() < 0.95  # others are hidden, or lie on an outline
    own = now.centers[j] - before.centers[i]
    np.testing.assert_allclose(found[is_known], own[is_known], atol=0.02)
    on_picture, is_seen = flow.at(now.centers[j])
    assert is_seen.mean() > is_known.mean()
    near = is_known & is_seen
    assert np.median(np.linalg.norm(on_picture - own, axis=1)[near]) < 0.4  # what 5 % of the depth make
    outside = np.array([[-3.0, 5.0], [100.0, 500.0]])
    assert not flow.at(outside)[1].any()
