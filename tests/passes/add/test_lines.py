"""Lines lie where a body has edges, once each; texture has none, and what is round fades from beside."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

import brushgs as bg
from brushgs.passes.add.lines import find_lines
from brushgs.rendering.facing import facing, fade_by_facing
from brushgs.values.quats import rotation_matrices
from brushgs.values.sh import base_colors
from tests.kit.for_each import for_each
from tests.passes.add.scenes import SIDE, cameras, cube, cube_edges, noisy_plane, sphere
from tests.passes.scenes import assert_same, random_gaussians, rescaled

SIGMAS = 1.6


@pytest.fixture(scope="module")
def cube_lines():
    return find_lines(cube(), cameras(), num_sigmas=SIGMAS)


def points_of(lines, num=9):
    """[L, num, 3] points along the boxes of pieces, from end to end."""
    strokes = lines.strokes
    longest = np.argmax(strokes.scales, axis=1)
    axes = rotation_matrices(strokes.quats)[np.arange(len(strokes)), :, longest]
    halves = SIGMAS * strokes.scales.max(axis=1)
    offsets = np.linspace(-1, 1, num)[None, :, None] * (halves[:, None] * axes)[:, None]
    return strokes.means[:, None] + offsets


def distances(points, others):
    """[P] from each point to the nearest of others."""
    return cKDTree(others).query(points)[0]


def samples(edge, margin=0.0):
    return edge[0] + np.linspace(margin, 1 - margin, 41)[:, None] * (edge[1] - edge[0])


def test_all_edges_of_a_cube_have_lines_and_nothing_else(cube_lines):
    drawn = points_of(cube_lines).reshape(-1, 3)
    shares = [np.mean(distances(samples(edge, 0.03), drawn) < 0.06 * SIDE) for edge in cube_edges()]
    assert min(shares) >= 0.9, shares
    edges = np.concatenate([samples(edge) for edge in cube_edges()])
    far = distances(points_of(cube_lines, 3).reshape(-1, 3), edges) > 0.1 * SIDE
    assert far.mean() < 0.02


def test_strengths_are_of_lines_and_the_weaker_can_be_left_out(cube_lines):
    assert 0 <= cube_lines.strengths.min() <= cube_lines.strengths.max() <= 1
    assert (np.diff(cube_lines.chains) >= 0).all()
    same_chain = np.diff(cube_lines.chains) == 0
    assert not np.diff(cube_lines.strengths)[same_chain].any()
    middle = float(np.median(cube_lines.strengths))
    fewer = cube_lines.stronger_than(middle)
    assert 0 < len(fewer) < len(cube_lines)
    assert fewer.strengths.min() >= middle
    assert len(fewer.strokes) == len(fewer.chains) == len(fewer.normals) == len(fewer)
    assert len(cube_lines.stronger_than(0)) == len(cube_lines)


def test_texture_has_no_lines():
    assert len(find_lines(noisy_plane(), cameras([(0, 0), (-12, 0), (12, 0)]))) == 0


def test_a_sphere_has_its_outline_and_nothing_else():
    lines, camera = find_lines(sphere(), cameras(), num_sigmas=SIGMAS), cameras()[0]
    means = lines.strokes.means
    first = facing(means, lines.normals, camera) < 0.1
    eye = camera.position
    radius, distance = 0.7, np.linalg.norm(eye)
    # The cone that touches the sphere: the angle of its rays with the axis.
    rays = means[first] - eye
    angles = np.arccos(rays @ -eye / distance / np.linalg.norm(rays, axis=1))
    np.testing.assert_allclose(angles, np.arcsin(radius / distance), rtol=0.04)
    around = np.degrees(np.arctan2(*((rays - rays.mean(axis=0)) @ camera.viewmat[:2, :3].T).T))
    assert np.diff(np.sort(around)).max() < 30


def test_lines_are_the_same_for_any_threads_and_in_any_unit(cube_lines):
    drawn = bg.plain_views(cube(), cameras())  # without depth: they are drawn again
    for views, num_threads in ((cameras(), 1), (cameras(), 3), (drawn, None)):
        again = find_lines(cube(), views, num_sigmas=SIGMAS, num_threads=num_threads)
        assert_same(again.strokes, cube_lines.strokes)
        for name in ("strengths", "chains", "normals"):
            np.testing.assert_array_equal(getattr(again, name), getattr(cube_lines, name))
    views = [bg.Camera.look_at(64 * view.position, (0, 0, 0), width=400, height=300) for view in cameras()]
    large = find_lines(rescaled(cube(), 64), views, num_sigmas=SIGMAS)
    assert abs(len(large) - len(cube_lines)) <= 0.05 * len(cube_lines)


def test_width_color_and_opacity_are_as_given():
    thin = find_lines(cube(), cameras()[:1], width=1.0)
    wide = find_lines(cube(), cameras()[:1], width=3.0, color=(0.2, 0.3, 0.4), opacity=0.5)
    first, second = (np.median(lines.strokes.scales.min(axis=1)) for lines in (thin, wide))
    np.testing.assert_allclose(second / first, 3, rtol=0.1)
    colors = base_colors(wide.strokes.sh)
    np.testing.assert_allclose(colors, np.broadcast_to([0.2, 0.3, 0.4], colors.shape), atol=1e-6)
    np.testing.assert_allclose(wide.strokes.opacities, 0.5)
    assert wide.strokes.means.dtype == np.float32


@for_each("num", [0, 1, 2, 5])
def test_scenes_of_almost_nothing(num):
    scene = random_gaussians(num, dtype=np.float32)
    lines = find_lines(scene, cameras())
    assert np.isfinite(lines.strokes.means).all()
    assert np.isfinite(lines.normals).all()
    assert lines.strokes.means.dtype == np.float32
    assert num or not len(lines)


@pytest.mark.parametrize("size", [(1, 1), (2, 3), (7, 300)])
def test_pictures_of_any_size(size):
    camera = bg.Camera.look_at((0, 0, -3), (0, 0, 0), width=size[0], height=size[1])
    find_lines(cube(), [camera])
    find_lines(cube(), [cameras()[0], camera])


@for_each(
    ("name", "value"),
    [("width", 0), ("width", np.nan), ("num_sigmas", -1), ("opacity", 1.5), ("opacity", np.nan)],
)
def test_arguments_are_checked(name, value):
    with pytest.raises(ValueError, match=f"find_lines: {name}"):
        find_lines(cube(), cameras()[:1], **{name: value})
    with pytest.raises(ValueError, match="at least one camera"):
        find_lines(cube(), [])


def test_only_what_has_a_normal_fades_by_facing():
    strokes, camera = random_gaussians(20), cameras()[0]
    boxes = bg.project(strokes, camera)
    found = fade_by_facing(boxes, camera, strokes, np.zeros((20, 3)))
    np.testing.assert_array_equal(found.opacities, boxes.opacities)
    with pytest.raises(ValueError, match="shape"):
        fade_by_facing(boxes, camera, strokes, np.zeros((3, 3)))
