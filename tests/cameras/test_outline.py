import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from brushgs.cameras.outline import MOST_VERTICES, outline
from tests.kit.for_each import for_each


def cloud(kind, num, seed):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(num, 3))
    if kind == "ball":
        points /= np.linalg.norm(points, axis=1, keepdims=True)
    elif kind == "box":
        points = rng.uniform(-1, 1, (num, 3))
    elif kind == "clipped":  # many points on the sides of a box
        points = np.clip(points, -0.7, 0.7)
    elif kind == "grid":
        points = np.rint(points * 2)
    return points


@settings(max_examples=60, deadline=None)
@given(
    kind=st.sampled_from(["normal", "ball", "box", "clipped", "grid"]),
    num=st.integers(5, 3000),
    seed=st.integers(0, 10**6),
    stretch=st.sampled_from([(1, 1, 1), (1, 1e-3, 1), (1e4, 1e4, 1e4), (1e-5, 1e-5, 1e-5)]),
)
def test_the_outline_reaches_as_far_as_the_points_in_every_direction(kind, num, seed, stretch):
    points = cloud(kind, num, seed) * stretch + np.multiply(stretch, 3)
    found = outline(points)
    directions = np.random.default_rng(1).normal(size=(500, 3)) / stretch
    reach, all_reach = (found @ directions.T).max(axis=0), (points @ directions.T).max(axis=0)
    share = 0.005 if len(found) == MOST_VERTICES else 1e-10
    np.testing.assert_allclose(reach, all_reach, rtol=0, atol=share * np.abs(points @ directions.T).max())
    assert len(found) <= MOST_VERTICES
    assert set(map(tuple, found)) <= set(map(tuple, points))


@for_each(
    ("points", "corners"),
    [
        ([[1, 2, 3]], [[1, 2, 3]]),
        ([[1, 2, 3]] * 5, [[1, 2, 3]]),
        ([[0, 0, 0], [1, 0, 0]], [[0, 0, 0], [1, 0, 0]]),
        (np.linspace([0, 0, 0], [1, 2, 3], 50), [[0, 0, 0], [1, 2, 3]]),
        ([[x, y, 7e6] for x in range(5) for y in range(5)], [[x, y, 7e6] for x in (0, 4) for y in (0, 4)]),
        ([[x, y, x + 2 * y] for x in range(9) for y in range(9)], None),
    ],
)
def test_points_in_a_plane_or_on_a_line_have_the_corners_of_their_shape(points, corners):
    found = outline(np.array(points, float))
    corners = corners or [[x, y, x + 2 * y] for x in (0, 8) for y in (0, 8)]
    assert set(map(tuple, corners)) <= set(map(tuple, found))
    assert len(found) <= len(corners) + 4  # rounding errors may keep points of an edge


def test_of_more_vertices_than_are_kept_the_most_prominent_are():
    """Measured: 0.0072 of the radius are lost; with any 512 points of the ball 0.022 to 0.032."""
    points, toward = cloud("ball", 3000, seed=3000), cloud("ball", 2000, seed=1)
    found = outline(points)
    assert len(found) == MOST_VERTICES
    assert ((points @ toward.T).max(axis=0) - (found @ toward.T).max(axis=0)).max() < 0.008


@for_each("kind, num", [("normal", 9), ("normal", 3000), ("ball", 500), ("box", 3000), ("grid", 300)])
def test_the_outline_is_the_hull_that_scipy_finds(kind, num):
    points = cloud(kind, num, seed=num)
    assert set(map(tuple, outline(points))) == set(map(tuple, points[ConvexHull(points).vertices]))
