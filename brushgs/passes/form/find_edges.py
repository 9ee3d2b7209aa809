"""The hardness of outlines in a few views, and the role of each stroke in them.

A stroke is at the outline of a view if it, or half of it, is near to one in the picture, even if hidden:
paint behind a soft edge shows through it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from brushgs.passes.form.outline import Outline, View
from brushgs.passes.neighbours import nearest
from brushgs.values.arrays import F64, Mask, Rows, smoothstep
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices

LOST_RAMP = 0.6  # of the lost share of the outline, width of the gradual part
FOUND_RAMP = 0.10  # share of the outline that is found gradually
FOCUS = 2 / 3  # minimum rank of the focus for found edges
# Minimum factor of contrast, light and focus: between equal values an edge is lost in the focus too.
LEAST_CONTRAST, LEAST_LIGHT, LEAST_FOCUS = 0.10, 0.10, 0.15
REACH = 0.035  # of the longer side of a view: strokes inside this distance are at the outline
SHARE = 0.3  # the same limit, of the width of the subject: a leg must not fade from both sides
BEYOND = 9.0  # pixels outside of a view in which strokes count
CELL = 2.0  # pixels, side of cells with one nearest point of an outline
BETWEEN = 0.15  # softness of edges that are neither lost nor found: firm, but not crisp
_TINY = np.finfo(np.float64).tiny


@dataclass(frozen=True, eq=False)
class Edges:
    """The role of k strokes in the outlines of the subject; all 0 for those at no outline.

    Attributes:
        lost: [k] 0 to 1, softness.
        found: [k] 0 to 1, crispness.
        near: [k] 0 to 1, nearness to an outline, soft or crisp.
        behind: [k, 3] OKLab of the background.
        along: [k, 3, 3] mean outer product of the direction of the outline, world axes.
        across: [k, 3, 3] likewise of the direction across it.
    """

    lost: F64
    found: F64
    near: F64
    behind: F64
    along: F64
    across: F64


def hardness(outlines: Sequence[Outline], has_focus: bool, lose: float, find: float) -> tuple[F64, F64]:
    """How strongly each point is to be lost and found, over all outlines, concatenated; both 0 to 1.

    Args:
        outlines: their points hold light, focus, and whether they belong to the subject.
        has_focus: False takes the upper part of the pictures.
        lose: share of the outline at the middle of the ramp of lost edges.
        find: share that is found, first in the focus.
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
    lost[is_subject] = soft = smoothstep((lose - ranks) / max(LOST_RAMP * lose, _TINY) + 0.5)
    hardest = _ranks(ranks + (focus > FOCUS))
    found[is_subject] = crisp = smoothstep((hardest - (1 - find)) / FOUND_RAMP) * (1 - soft)
    lost[is_subject] += BETWEEN * (1 - soft - crisp)
    return lost, found


def _factor(ranks: F64, least: float) -> F64:
    return least + (1 - least) * ranks


def _ranks(values: F64) -> F64:
    """[n] share of smaller values, 0 to 1; equal for equal values."""
    ordered = np.sort(values)
    below, up_to = (np.searchsorted(ordered, values, side=side) for side in ("left", "right"))
    return np.asarray((below + up_to) / (2 * len(values)))


def gathered(strokes: Gaussians, views: Sequence[View], lost: F64, found: F64) -> Edges:
    """The role of each stroke in the outlines, over all views.

    Softness is the root mean square: in an orbit few views have a stroke at their outline.

    Args:
        strokes: k strokes.
        views: at least one.
        lost: of the points of all outlines, concatenated; `found` likewise.
        found: see `lost`.
    """
    spots, count = _spots(strokes), len(strokes)
    squares, sums, views_of = np.zeros((count, 2)), np.zeros(count), np.zeros(count)
    behind, along, across = (np.zeros((count, *shape)) for shape in ((3,), (3, 3), (3, 3)))
    first = 0
    for view in views:
        outline = view.outline
        here = slice(first, first := first + len(outline.places))
        near, rows, is_seen = _near(spots, view)
        squares += (near[:, None] * np.stack([lost[here][rows], found[here][rows]], axis=1)) ** 2
        sums += near
        views_of += is_seen
        behind += near[:, None] * outline.behind[rows]
        normals = outline.outward[rows]
        turn, none = view.camera.viewmat[:3, :3], np.zeros(count)
        for total, x, y in ((along, -normals[:, 1], normals[:, 0]), (across, normals[:, 0], normals[:, 1])):
            vectors = np.stack([x, y, none], axis=1) @ turn
            total += near[:, None, None] * vectors[:, :, None] * vectors[:, None, :]
    amounts = np.sqrt(squares / np.maximum(views_of, 1)[:, None])
    weights = np.where(sums > 0, sums, 1.0)
    return Edges(
        amounts[:, 0],
        amounts[:, 1],
        sums / np.maximum(views_of, 1),
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
    """[k] nearness of strokes to an outline, 0 to 1; the points nearest to their centers; and whether these
    are in the picture.
    """
    camera, outline = view.camera, view.outline
    size = np.array([camera.width, camera.height], np.float64)
    reach = np.minimum(REACH * size.max(), SHARE * outline.width)
    local = spots @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
    is_ahead = local[..., 2] > camera.near
    depths = np.where(is_ahead, local[..., 2], 1.0)
    places = local[..., :2] / depths[..., None] * (camera.K[0, 0], camera.K[1, 1]) + camera.K[:2, 2]
    is_seen = is_ahead & ((places > -BEYOND) & (places < size + BEYOND)).all(axis=2)
    places = np.where(is_seen[..., None], places, 0.0)
    columns, lines = (np.arange(-BEYOND + CELL / 2, side + BEYOND + CELL, CELL) for side in size)
    cells = np.stack(np.meshgrid(columns, lines), axis=2)
    column, line = np.moveaxis(((places + BEYOND) / CELL).astype(np.intp), 2, 0)
    rows = nearest(outline.places, cells.reshape(-1, 2), 1)[1][line * len(columns) + column, 0]
    steps = places - outline.places[rows]
    out = (steps * outline.outward[rows]).sum(axis=2)
    inside = np.clip(1 + out / np.maximum(reach[rows], _TINY), 0, 1)
    is_beside = np.linalg.norm(steps, axis=2) < np.where(out > 0, 2.0, 1.3) * np.maximum(reach[rows], 2.0)
    is_before = view.depth / depths > outline.middle[rows]
    near = np.where(is_seen & is_beside & is_before, inside, 0.0).mean(axis=0)
    return near, rows[0], is_seen[0]
