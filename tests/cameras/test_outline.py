import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from brushgs.cameras.outline import MOST_VERTICES, outline
from brushgs.core.native import core as _core
from tests.kit.for_each import for_each

THICKNESS = 1e-12


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
        (
            [[x, y, 7e6] for x in range(5) for y in range(5)],
            [[0, 0, 7e6], [4, 0, 7e6], [0, 4, 7e6], [4, 4, 7e6]],
        ),
        ([[x, y, x + 2 * y] for x in range(9) for y in range(9)], None),
    ],
)
def test_points_in_a_plane_or_on_a_line_have_the_corners_of_their_shape(points, corners):
    found = outline(np.array(points, float))
    corners = corners or [[x, y, x + 2 * y] for x in (0, 8) for y in (0, 8)]
    assert set(map(tuple, corners)) <= set(map(tuple, found))
    assert len(found) <= len(corners) + 4  # rounding errors may keep points of an edge


@for_each("kind", ["normal", "ball", "clipped", "grid"])
@for_each("num", [9, 300, 3000])
def test_the_hull_of_the_core_is_that_of_numpy(kind, num):
    points = cloud(kind, num, seed=num)
    offsets = points - points[0]
    b = np.argmax((offsets**2).sum(axis=1))
    normals = np.cross(offsets, offsets[b])
    c = np.argmax((normals**2).sum(axis=1))
    simplex = [0, int(b), int(c), int(np.argmax(np.abs(offsets @ normals[c])))]
    found = _core.hull_rows(points, simplex=simplex, most=100, thickness=THICKNESS)
    np.testing.assert_array_equal(found, hull(points, simplex, most=100))


def hull(places, simplex, most):
    """Ascending rows of the vertices of the convex hull, which grows from `simplex` by the farthest point."""
    a, b, c, d = simplex
    middle = places[simplex].mean(axis=0)
    facets = np.array([[a, b, c], [a, b, d], [a, c, d], [b, c, d]])
    planes = _planes(places, facets, middle)
    rows = np.arange(len(places))  # of the points outside, with their facet and their height above it
    rows, owners, heights = _above(places, rows, planes, 0)
    is_facet = np.ones(len(facets), bool)
    for _ in range(most - len(simplex)):
        if not len(rows):
            break
        farthest = int(np.argmax(heights))
        point = rows[farthest]
        is_seen = is_facet & (planes[:, :3] @ places[point] + planes[:, 3] > THICKNESS)
        is_seen[owners[farthest]] = True
        is_facet &= ~is_seen
        fan = np.insert(_horizon(facets[is_seen], len(places)), 2, point, axis=1)
        fan_planes = _planes(places, fan, middle)
        is_orphan = is_seen[owners]
        is_orphan[farthest] = False  # a vertex now, despite rounding errors of thin facets
        adopted = _above(places, rows[is_orphan], fan_planes, len(facets))
        is_left = ~is_seen[owners]
        kept = rows[is_left], owners[is_left], heights[is_left]
        rows, owners, heights = (np.concatenate(pair) for pair in zip(kept, adopted, strict=True))
        facets, planes = np.concatenate([facets, fan]), np.concatenate([planes, fan_planes])
        is_facet = np.concatenate([is_facet, np.ones(len(fan), bool)])
    return np.unique(facets[is_facet])


def _planes(places, facets, inside):
    """[f, 4] outward unit normal and offset of each facet: positive heights are outside."""
    a, b, c = places[facets[:, 0]], places[facets[:, 1]], places[facets[:, 2]]
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    normals *= np.where(((a - inside) * normals).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    return np.column_stack([normals, -(a * normals).sum(axis=1)])


def _above(places, rows, planes, first):
    """Those of `rows` outside a plane; the plane each is highest above, counted from `first`; the height."""
    heights = places[rows] @ planes[:, :3].T + planes[:, 3]
    best = heights.argmax(axis=1)
    highest = heights[np.arange(len(rows)), best]
    is_above = highest > THICKNESS
    return rows[is_above], best[is_above] + first, highest[is_above]


def _horizon(facets, num_points):
    """[e, 2] edges that belong to only one of the facets."""
    edges = np.sort(np.concatenate([facets[:, [0, 1]], facets[:, [1, 2]], facets[:, [2, 0]]]), axis=1)
    keys, counts = np.unique(edges[:, 0] * num_points + edges[:, 1], return_counts=True)
    once = keys[counts == 1]
    return np.stack([once // num_points, once % num_points], axis=1)
