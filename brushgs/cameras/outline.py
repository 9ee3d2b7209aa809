"""Convex hulls: the only points that framing depends on."""

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import F64

I64 = NDArray[np.int64]
MOST_VERTICES = 512  # for a ball of 20,000 points the error is 0.004 of its size
_THICKNESS = 1e-12  # of facets, over the size of the points: rounding errors are 1e-16


def outline(points: F64) -> F64:
    """The vertices of the convex hull of points, including planar and collinear ones.

    Beyond `MOST_VERTICES`, the least prominent ones are omitted. Of 18,000 points of a real subject 50 to 220
    remain, found in 20 ms; libraries of convex hulls are faster, but take 400 ms to import.
    Source: Barber, Dobkin and Huhdanpaa 1996, The Quickhull Algorithm for Convex Hulls.

    Args:
        points: [n, 3], n >= 1, finite.

    Returns:
        [m, 3] in the order of the rows, without repetition.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    places = (points - 0.5 * (low + high)) / np.where(high > low, high - low, 1.0)
    a = _farthest(((places - places[0]) ** 2).sum(axis=1))
    offsets = places - places[a]
    b = _farthest((offsets**2).sum(axis=1))
    normals = np.cross(offsets, offsets[b])
    c = _farthest((normals**2).sum(axis=1))
    area = float(np.linalg.norm(normals[c]))
    if area <= _THICKNESS:
        return points[np.unique([a, b])] if np.linalg.norm(offsets[b]) > _THICKNESS else points[:1]
    heights = offsets @ (normals[c] / area)
    d = _farthest(np.abs(heights))
    if abs(heights[d]) <= _THICKNESS:  # planar: the hull of a pyramid over it, without its top
        d = len(places)
        places = np.concatenate([places, [places[[a, b, c]].mean(axis=0) + normals[c] / area]])
    rows = _hull(places, [a, b, c, d])
    return points[rows[rows < len(points)]]


def _farthest(distances: F64) -> int:
    return int(np.argmax(distances))


def _hull(places: F64, simplex: list[int]) -> I64:
    """Ascending rows of the vertices of the convex hull, which grows from `simplex` by the farthest point."""
    a, b, c, d = simplex
    middle = places[simplex].mean(axis=0)
    facets = np.array([[a, b, c], [a, b, d], [a, c, d], [b, c, d]])
    planes = _planes(places, facets, middle)
    rows = np.arange(
        len(places)
    )  # of the points that are outside, with their facet and their height above it
    rows, owners, heights = _above(places, rows, planes, 0)
    is_facet = np.ones(len(facets), bool)
    for _ in range(MOST_VERTICES - len(simplex)):
        if not len(rows):
            break
        farthest = int(np.argmax(heights))
        point = rows[farthest]
        is_seen = is_facet & (planes[:, :3] @ places[point] + planes[:, 3] > _THICKNESS)
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


def _planes(places: F64, facets: I64, inside: F64) -> F64:
    """[f, 4] outward unit normal and offset of each facet: positive heights are outside."""
    a, b, c = places[facets[:, 0]], places[facets[:, 1]], places[facets[:, 2]]
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    normals *= np.where(((a - inside) * normals).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    return np.column_stack([normals, -(a * normals).sum(axis=1)])


def _above(places: F64, rows: I64, planes: F64, first: int) -> tuple[I64, I64, F64]:
    """Those of `rows` outside a plane; the plane each is highest above, counted from `first`; the height."""
    heights = places[rows] @ planes[:, :3].T + planes[:, 3]
    best = heights.argmax(axis=1)
    highest = heights[np.arange(len(rows)), best]
    is_above = highest > _THICKNESS
    return rows[is_above], best[is_above] + first, highest[is_above]


def _horizon(facets: I64, num_points: int) -> I64:
    """[e, 2] edges that belong to only one of the facets."""
    edges = np.sort(np.concatenate([facets[:, [0, 1]], facets[:, [1, 2]], facets[:, [2, 0]]]), axis=1)
    keys, counts = np.unique(edges[:, 0] * num_points + edges[:, 1], return_counts=True)
    once = keys[counts == 1]
    return np.stack([once // num_points, once % num_points], axis=1)
