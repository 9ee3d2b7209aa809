"""Turn strokes within their own plane, along the form they depict.

Clustering gives strokes that are about as long as wide, in random directions: paint on a plank lies across
it. Here each stroke gets a direction from its surroundings, smoothed over neighbors in space. Strokes
without a clear direction stay, and slender ones keep their axis. Position, normal, thickness, area, opacity
and color stay. A stroke becomes at most `ASPECT` times as long as wide; less where neighbors disagree, and
never thinner than thick. The core computes it, and that of a page too.

Direction (as twice the angle) and aspect (as logarithm) form one 2D vector, so that shapes change without
jumps.
"""

import numpy as np

from brushgs.core.native import core as _core
from brushgs.formats.guides import Guides
from brushgs.options.direction import Direction
from brushgs.passes.extent import robust_frame
from brushgs.passes.form.mark_directions import Marks, mark_wish
from brushgs.passes.form.neighborhood import Neighborhood
from brushgs.passes.form.open_field import open_field
from brushgs.passes.form.planes import Planes, Wish, pairs_of, ramp
from brushgs.passes.neighbours import nearest
from brushgs.values.arrays import F64, Rows
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

ASPECT: float = _core.FORM_ASPECT  # largest of turned strokes
WISH = 4.0  # weight of a direction set by the user, where fully clear; a field has up to 4.2
# Lengths of the own field over which it gains priority over the marks of a style, and the share of these that
# it then replaces: smooth places follow the flow of the painting, form keeps its own direction.
FORMED, FORM = (0.3, 1.5), 0.7


def orient(
    strokes: Gaussians,
    gaussians: Gaussians,
    field: str | Direction | Guides | Marks = "form",
    *,
    camera: Camera | None = None,
) -> Gaussians:
    """Turn strokes within their own plane, along the form they depict.

    Args:
        strokes: n strokes; their plane is perpendicular to their shortest axis.
        gaussians: the scene they were made of, for surface colors.
        field: "form": along lines of equal color, least curvature, extent of the surface, and slender
            strokes nearby. "color": only along lines of equal color. "own": unchanged. "guides:FILE": along
            lines in space, see `read_guides`; "painting:FILE": as the brush marks of a picture, see
            `mark_wish`; both fall back to "form". Or a parsed `Direction`, or opened `Guides` or `Marks`, see
            `open_field`.
        camera: the view that a painting from a file lies over.

    Returns:
        The strokes in their order and dtype, with other quats and scales; the input itself if nothing can
        change.

    Raises:
        ValueError: if the field is unknown, or a painting lacks its camera.
        SceneError: if the file cannot be used.

    Strokes with an aspect above 2.2 keep their axes (above 6 under guides and marks). Signs are chosen so
    that neighbors point the same way: with the lock "anchor", stroke images run along the longest axis. Up
    to rounding the result does not depend on unit, position, order of rows or number of threads; equal input
    gives bit-identical output.

    Example:
        >>> along = bg.orient(strokes, gaussians, "form")
        >>> len(along) == len(strokes)
        True
    """
    if isinstance(field, str):
        field = Direction.of(field)
    opened = open_field(field, camera) if isinstance(field, Direction) else field
    if opened == "own" or len(strokes) == 0 or len(gaussians) == 0:
        return strokes
    around = Neighborhood(strokes)
    pairs, weights = around.field(gaussians, by_color_alone=opened == "color")
    if isinstance(opened, str):
        return around.turned(pairs, weights)
    planes = Planes.of(strokes)
    wish = guide_wish(opened, planes) if isinstance(opened, Guides) else mark_wish(opened, planes)
    wished, aspects, marked = wish.pairs, np.full(len(planes), ASPECT), np.zeros(len(planes))
    aspect = opened.aspect if isinstance(opened, Marks) else None
    if aspect is not None:
        wished = wished * (1 - FORM * ramp(np.hypot(pairs[:, 0], pairs[:, 1]), *FORMED))[:, None]
    say = np.hypot(wished[:, 0], wished[:, 1])
    if isinstance(opened, Marks) and aspect is not None:
        marked = say / max(opened.clearest, np.finfo(np.float64).tiny)
        aspects *= (aspect / ASPECT) ** marked
    pairs = (1 - say)[:, None] * pairs + WISH * wished
    weights = (1 - say) * weights + WISH * say
    return around.turned(pairs, weights, say=say, aspects=aspects, marked=marked, headings=wish.headings)


# Stroke directions along guides: that of the nearest line in space, weaker with distance.


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
