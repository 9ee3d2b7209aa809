"""Stroke directions along guides: that of the nearest line in space, weaker with distance."""

import numpy as np

from brushgs.formats.guides import Guides
from brushgs.passes.extent import robust_frame
from brushgs.passes.form.planes import Planes, Wish, pairs_of
from brushgs.passes.neighbours import nearest
from brushgs.values.arrays import F64, Rows

REACH = 0.1  # scene radii, default reach of guides
STEP = 0.125  # of the reach, spacing of the search points on a guide
MOST_PLACES = 1 << 18  # maximum number of search points of all guides


def guide_wish(guides: Guides, planes: Planes) -> Wish:
    """The directions of strokes by guides.

    A stroke on a guide follows it fully, one at `reach` and beyond not at all; a guide perpendicular to the
    plane of a stroke has no effect. Strokes point in the direction in which the line was drawn.
    """
    center, radius = robust_frame(planes.means)
    reach = (guides.reach or REACH * radius) / radius
    starts, ends = (guides.starts - center) / radius, (guides.ends - center) / radius
    means = (planes.means - center) / radius
    along = ends - starts
    lengths = np.linalg.norm(along, axis=1)
    segments = _nearest_segments(starts, along, lengths, reach, means)
    units = along / np.where(lengths > 0, lengths, 1.0)[:, None]
    tangents, offsets = units[segments], means - starts[segments]
    at = np.clip(np.einsum("ni,ni->n", offsets, tangents), 0, lengths[segments])
    distances = np.linalg.norm(offsets - at[:, None] * tangents, axis=1)
    say = np.maximum(1 - np.minimum(distances / reach, 1) ** 2, 0) ** 2
    return Wish(say[:, None] * pairs_of(planes.project(tangents)), say[:, None] * tangents)


def _nearest_segments(starts: F64, along: F64, lengths: F64, reach: float, means: F64) -> Rows:
    """The segment that is nearest to each of the means, [n], to within half a step."""
    step = max(STEP * reach, float(lengths.sum()) / MOST_PLACES)
    counts = np.maximum(np.ceil(lengths / step), 1).astype(np.int64)
    owners = np.repeat(np.arange(len(starts)), counts)
    ranks = np.arange(len(owners)) - np.repeat(np.cumsum(counts) - counts, counts)
    places = starts[owners] + ((ranks + 0.5) / counts[owners])[:, None] * along[owners]
    _, rows = nearest(places, means, 1)
    return np.asarray(owners[rows[:, 0]])
