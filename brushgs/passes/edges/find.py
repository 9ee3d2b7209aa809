"""Outlines of a few views -> how hard they are, and what each stroke is to them.

A stroke is at the outline of a view where it, or half of it, is near to one in the picture, also behind what
shows there: what is behind a soft edge shows through it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from brushgs.arrays import F64, Mask, Rows, smoothstep
from brushgs.passes.edges.outline import Outline, View
from brushgs.passes.neighbours import nearest
from brushgs.quats import rotation_matrices
from brushgs.scene import Gaussians

LOST, LOST_RAMP = 0.40, 0.24  # share of the outline to the middle of the ramp in which edges get lost
FOUND, FOUND_RAMP = 0.30, 0.10  # share that is found, of which so much gradually
FOCUS = 2 / 3  # rank of the focus from which on edges are found
# Least factor of contrast, light and focus: where values meet an edge is lost in the focus too.
LEAST_CONTRAST, LEAST_LIGHT, LEAST_FOCUS = 0.10, 0.45, 0.2
REACH = 0.035  # of the longer side of a view, to which strokes inside an outline are at it
SHARE = 0.3  # of the width of the subject, likewise: a leg must not fade from both sides
BEYOND = 9.0  # pixels outside of a view in which strokes count
_TINY = np.finfo(np.float64).tiny


@dataclass(frozen=True, eq=False)
class Edges:
    """What k strokes are to the outlines of the subject; all 0 for those that are at none.

    Attributes:
        lost: [k] 0 to 1, how soft.
        found: [k] 0 to 1, how crisp.
        near: [k] 0 to 1, how near to an outline, soft or crisp.
        behind: [k, 3] OKLab of what is behind.
        along: [k, 3, 3] mean outer product of the direction of the outline, world axes.
        across: [k, 3, 3] likewise of the direction across it.
    """

    lost: F64
    found: F64
    near: F64
    behind: F64
    along: F64
    across: F64


def hardness(outlines: Sequence[Outline], has_focus: bool) -> tuple[F64, F64]:
    """How lost and how found each point is, over all outlines in turn, 0 to 1 both.

    Args:
        outlines: whose points say light, focus, and whether they belong to the subject.
        has_focus: False takes the upper part of the pictures for it.
    """
    says = np.concatenate([one.says for one in outlines])
    contrast = np.concatenate([one.contrast for one in outlines])
    is_subject = says[:, 2] > 0.5
    lost, found = np.zeros((2, len(says)))
    if not is_subject.any():
        return lost, found
    heights = np.concatenate([-one.places[:, 1] for one in outlines])
    focus = _ranks(says[is_subject, 1] if has_focus else heights[is_subject])
    hard = _factor(_ranks(contrast[is_subject]), LEAST_CONTRAST) * _factor(focus, LEAST_FOCUS)
    hard *= _factor(_ranks(says[is_subject, 0]), LEAST_LIGHT)
    ranks = _ranks(hard)
    lost[is_subject] = smoothstep((LOST + LOST_RAMP / 2 - ranks) / LOST_RAMP)
    in_focus = focus > FOCUS
    hardest = _ranks(ranks + in_focus)
    found[is_subject] = in_focus * smoothstep((hardest - (1 - FOUND)) / FOUND_RAMP)
    found *= 1 - lost
    return lost, found


def _factor(ranks: F64, least: float) -> F64:
    return least + (1 - least) * ranks


def _ranks(values: F64) -> F64:
    """[n] shares of values that are less, 0 to 1; of equal ones all the same."""
    ordered = np.sort(values)
    below, up_to = (np.searchsorted(ordered, values, side=side) for side in ("left", "right"))
    return np.asarray((below + up_to) / (2 * len(values)))


def gathered(strokes: Gaussians, views: Sequence[View], lost: F64, found: F64) -> Edges:
    """What each stroke is to the outlines, over all views.

    How soft it is, is the root of the mean square: of an orbit few views have a stroke at their outline.

    Args:
        strokes: k strokes.
        views: at least one.
        lost: of the points of all outlines in turn; `found` likewise.
        found: see `lost`.
    """
    spots, count = _spots(strokes), len(strokes)
    squares, nears, views_of = np.zeros((count, 2)), np.zeros(count), np.zeros(count)
    most, behind, along, across = (np.zeros((count, *shape)) for shape in ((), (3,), (3, 3), (3, 3)))
    first = 0
    for view in views:
        outline = view.outline
        here = slice(first, first := first + len(outline.places))
        near, rows, is_seen = _near(spots, view)
        squares += (near[:, None] * np.stack([lost[here][rows], found[here][rows]], axis=1)) ** 2
        nears += near
        most = np.maximum(most, near)
        views_of += is_seen
        behind += near[:, None] * outline.behind[rows]
        normals = outline.outward[rows]
        turn, none = view.camera.viewmat[:3, :3], np.zeros(count)
        for sums, x, y in ((along, -normals[:, 1], normals[:, 0]), (across, normals[:, 0], normals[:, 1])):
            vectors = np.stack([x, y, none], axis=1) @ turn
            sums += near[:, None, None] * vectors[:, :, None] * vectors[:, None, :]
    amounts = np.sqrt(squares / np.maximum(views_of, 1)[:, None])
    weights = np.where(nears > 0, nears, 1.0)
    return Edges(
        amounts[:, 0],
        amounts[:, 1],
        nears / np.maximum(views_of, 1),
        behind / weights[:, None],
        along / weights[:, None, None],
        across / weights[:, None, None],
    )


def _spots(strokes: Gaussians) -> F64:
    """[5, k, 3] the middle of strokes, and four points a deviation from it along their two longer axes."""
    order = np.argsort(strokes.scales, axis=1, kind="stable")
    axes = np.take_along_axis(rotation_matrices(strokes.quats), order[:, None, :], axis=2)
    scales = np.sort(strokes.scales, axis=1).astype(np.float64)
    means = strokes.means.astype(np.float64)
    steps = [sign * axes[:, :, axis] * scales[:, axis, None] for axis in (1, 2) for sign in (1, -1)]
    return np.stack([means, *(means + step for step in steps)])


def _near(spots: F64, view: View) -> tuple[F64, Rows, Mask]:
    """[k] how near strokes are to an outline, 0 to 1; the points nearest to their middles; and whether these
    are in the picture.
    """
    camera, outline = view.camera, view.outline
    size = np.array([camera.width, camera.height], np.float64)
    reach = np.minimum(REACH * size.max(), SHARE * outline.width)
    near = np.zeros(spots.shape[1])
    first: tuple[Rows, Mask] | None = None
    for points in spots:
        local = points @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
        is_ahead = local[:, 2] > camera.near
        depths = np.where(is_ahead, local[:, 2], 1.0)
        places = local[:, :2] / depths[:, None] * (camera.K[0, 0], camera.K[1, 1]) + camera.K[:2, 2]
        is_seen = is_ahead & ((places > -BEYOND) & (places < size + BEYOND)).all(axis=1)
        places = np.where(is_seen[:, None], places, 0.0)
        distances, rows = _nearest_of(outline.places, places)
        out = ((places - outline.places[rows]) * outline.outward[rows]).sum(axis=1)
        inside = np.clip(1 + out / np.maximum(reach[rows], _TINY), 0, 1)
        is_beside = distances < np.where(out > 0, 2.0, 1.3) * np.maximum(reach[rows], 2.0)
        is_before = view.depth / depths > outline.middle[rows]
        near += np.where(is_seen & is_beside & is_before, inside, 0.0) / len(spots)
        first = (rows, is_seen) if first is None else first
    assert first is not None, "there are five spots"
    return near, *first


def _nearest_of(places: F64, queries: F64) -> tuple[F64, Rows]:
    distances, rows = nearest(places, queries, 1)
    return distances[:, 0], rows[:, 0]
