"""The toned ground, and the backdrop of loose strokes around a scene."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from brushgs.cameras.framing import frame_scene, plain_first_view
from brushgs.cameras.orbit import orbit
from brushgs.passes.add.backdrop import (
    BEYOND_EYE,
    RADIUS,
    Backdrop,
    Tone,
    backdrop,
    ground_color,
    is_land,
    mean_lab,
    reason_for_none,
)
from brushgs.passes.extent import robust_frame
from brushgs.rendering.project import project
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices
from brushgs.values.sh import base_colors
from tests.kit.for_each import for_each
from tests.passes.scenes import assert_same, gaussians_at, on_sphere

SIZE = {"width": 160, "height": 120}


def ball(n: int = 500, color=(0.2, 0.5, 0.3), dtype=np.float32, scale: float = 1.0) -> Gaussians:
    """Gaussians of one color in a ball around (3, -2, 5)."""
    g = np.random.default_rng(0)
    means = scale * g.uniform(0, 1, (n, 1)) ** (1 / 3) * on_sphere(n) + np.array([3, -2, 5])
    return gaussians_at(means, 0.05 * scale, color, quats=g.normal(0, 1, (n, 4)), dtype=dtype)


def strokes_of(scene: Gaussians, look: Backdrop | None = None, **options):
    view = plain_first_view(scene)
    return backdrop(scene, view, [frame_scene(view, **SIZE)], look, **options)


def test_the_ground_is_the_complement_of_the_scene_a_little_warm():
    lab = oklab_of(np.array([ground_color(ball())]))[0]
    own = oklab_of(np.array([(0.2, 0.5, 0.3)]))[0]
    np.testing.assert_allclose(lab, [0.58, *(-0.6 * own[1:] + (0.012, 0.04))], atol=2e-3)
    lab = oklab_of(np.array([ground_color(ball(), Tone(0.9, 0.0, (0.004, 0.028)))]))[0]
    np.testing.assert_allclose(lab, [0.9, 0.004, 0.028], atol=2e-3)


def test_a_gaussian_counts_by_its_area_and_opacity_or_by_given_weights():
    two = gaussians_at(np.zeros((2, 3)), [[1] * 3, [2] * 3], [(1, 0, 0), (0, 0, 1)], dtype=np.float32)
    red, blue = oklab_of(np.array([(1.0, 0, 0), (0, 0, 1)]))
    np.testing.assert_allclose(mean_lab(two), (red + 4 * blue) / 5, atol=1e-5)
    np.testing.assert_allclose(mean_lab(two, np.array([3.0, 1.0])), (3 * red + blue) / 4, atol=1e-5)
    grey = oklab_of(np.full((1, 3), 0.5))[0]
    np.testing.assert_allclose(mean_lab(two, np.zeros(2)), grey, atol=1e-12)  # rounding
    np.testing.assert_allclose(mean_lab(two.take(slice(0))), grey, atol=1e-12)  # rounding


@for_each("look", [Backdrop(), Backdrop(strokes=5200, aspect=1.8, size=1.7)])
def test_strokes_stand_on_a_sphere_around_scene_and_cameras(look):
    scene = ball()
    view = plain_first_view(scene)
    cameras = orbit(view, 6, **SIZE)
    strokes = backdrop(scene, view, cameras, look)
    center, radius = robust_frame(scene.means)
    farthest = max(np.linalg.norm(c.position - center) for c in cameras)
    distances = np.linalg.norm(strokes.means - center, axis=1)
    np.testing.assert_allclose(distances, max(RADIUS * radius, BEYOND_EYE * farthest), rtol=1e-5)
    assert 0.1 * look.strokes < len(strokes) <= look.strokes * 1.01


def test_strokes_are_flat_face_the_centre_and_have_the_aspect_asked_for():
    scene = ball(dtype=np.float64)
    strokes = strokes_of(scene)
    outward = strokes.means - robust_frame(scene.means)[0]
    facing = (rotation_matrices(strokes.quats)[:, :, 2] * outward).sum(axis=1)
    np.testing.assert_allclose(np.abs(facing), np.linalg.norm(outward, axis=1), rtol=1e-9)
    np.testing.assert_allclose(strokes.scales[:, 0] / strokes.scales[:, 1], 3, rtol=1e-9)
    assert (strokes.scales[:, 2] < 0.1 * strokes.scales[:, 1]).all()
    assert strokes.sh.shape[1] == 1
    assert (strokes.opacities == 0.92).all()


def test_it_is_lighter_above_than_below_in_the_complement_of_the_scene():
    scene = ball(color=(0.2, 0.5, 0.3), dtype=np.float64)
    view = plain_first_view(scene)
    angles = product(range(6), (-1.2, 0, 1.2))
    cameras = [frame_scene(view, **SIZE, azimuth=a, elevation=e) for a, e in angles]
    strokes = backdrop(scene, view, cameras, Backdrop(strokes=20_000))
    lab = oklab_of(base_colors(strokes.sh))
    height = (strokes.means - robust_frame(scene.means)[0]) @ view.up
    height /= np.abs(height).max()
    for part, lightness in ((height > 0.6, 0.66), (height < -0.6, 0.40)):
        assert part.sum() > 1000
        assert lab[part, 0].mean() == pytest.approx(lightness, abs=0.003)
        assert lab[part, 0].std() == pytest.approx(0.018, rel=0.1)
    own = mean_lab(scene)
    assert (lab[:, 1].mean() - 0.006) * own[1] < 0
    smooth = np.convolve(lab[np.argsort(height), 0], np.ones(301) / 301, "valid")
    assert (np.diff(smooth[::300]) > -5 * 0.018 * np.sqrt(2 / 301)).all()


@for_each("elevation", [-0.3, 0.2, 1.5])
def test_what_a_camera_sees_of_the_whole_sphere_it_sees_of_the_backdrop(elevation):
    scene = ball()
    view = plain_first_view(scene)
    camera = frame_scene(view, **SIZE, elevation=elevation)
    around = [
        Camera.look_at(camera.position, np.add(camera.position, (np.sin(a), np.tan(e), np.cos(a))), **SIZE)
        for a, e in product(range(8), (-1.2, 0, 1.2))
    ]
    whole, part = (backdrop(scene, view, cameras) for cameras in ([camera, *around], [camera]))
    assert len(part) < 0.5 * len(whole)
    seen_whole, seen_part = (project(s, camera, num_sigmas=2.0) for s in (whole, part))
    np.testing.assert_array_equal(seen_part.centers, seen_whole.centers)
    assert len(seen_part) > 0.6 * len(part)


def test_the_same_seed_gives_the_same_strokes_in_any_unit_of_the_world():
    one, other = strokes_of(ball(), seed=4), strokes_of(ball(), seed=5)
    assert_same(strokes_of(ball(), seed=4), one)
    assert (other.means[:99] != one.means[:99]).all()
    large, small = strokes_of(ball(scale=100.0, dtype=np.float64)), strokes_of(ball(dtype=np.float64))
    np.testing.assert_allclose(large.scales, 100 * small.scales, rtol=0.02)
    assert (one.means.dtype, small.means.dtype) == (np.float32, np.float64)
    assert len(strokes_of(ball(), Backdrop(strokes=0))) == 0


def test_what_is_no_backdrop_is_refused():
    scene = ball()
    with pytest.raises(ValueError, match="at least one camera"):
        backdrop(scene, plain_first_view(scene), [])
    for bad in ({"strokes": -1}, {"aspect": 0.5}, {"size": 0}, {"opacity": 1.5}, {"lightness": -1}):
        (name,) = bad
        with pytest.raises(ValueError, match=f"Backdrop: {name} must be"):
            Backdrop(**bad)


def frame_with(border: float, middle: float = 1.0) -> Frame:
    alpha = np.full((50, 60), border)
    alpha[4:46, 4:56] = middle
    return Frame(np.zeros((50, 60, 3)), alpha)


def test_a_scene_that_fills_its_pictures_or_is_seen_from_inside_or_is_flat_gets_none():
    view = plain_first_view(ball())
    assert reason_for_none(view, [frame_with(0.1)]) is None
    assert reason_for_none(view, []) is None
    assert "fills" in reason_for_none(view, [frame_with(0.95)])
    assert reason_for_none(view, [frame_with(0.95), frame_with(0.2)]) is None
    assert "inside" in reason_for_none(replace(view, eye=np.zeros(3)), [frame_with(0.1)])
    assert not is_land(view)
    flat = replace(view, points=view.points * (1, 0.01, 1))
    assert is_land(flat)
    assert not is_land(replace(flat, eye=np.zeros(3)))
    assert "flat" in reason_for_none(flat, [frame_with(0.1)])
