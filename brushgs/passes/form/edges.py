"""Lost and found edges: soften and sharpen strokes at the outline of the subject.

Painters do not draw the whole outline: a quarter of it is lost, in the shade and where both sides have equal
values, and it is hardest in the focus. Its hardness is measured once per job, in small views:

    hardness = contrast x light x focus

The softest part is lost, so that together with edges lost before it is over a quarter: strokes there are
stretched along the outline, become transparent toward it, and take on the color behind. The hardest part in
the focus is found, more if too much was lost before: strokes are solid, do not spill, and differ from the
color behind. Strokes are the same in all frames, so nothing changes as the camera moves.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from brushgs.passes.form.outline import Around, Outline, View, view_of
from brushgs.passes.neighbours import nearest
from brushgs.rendering.view_by_view import view_by_view
from brushgs.values.arrays import F64, Array, Mask, Rows, check, smoothstep
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices
from brushgs.values.sh import base_colors, shift_base_colors

# The hardness of outlines in a few views, and the role of each stroke in them.
#
# A stroke is at the outline of a view if it, or half of it, is near to one in the picture, even if hidden:
# paint behind a soft edge shows through it.


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


MOST_VIEWS = 8  # with outlines
FITTED_VIEWS = 2  # of them, for fitting the strength
AIM = 0.27  # target share of lost outline
YIELD, MOST = 0.4, 0.5  # lost share per softened share; and maximum softened share
FOUND = 0.30  # share that is found, plus the excess of lost edges
GAIN = 1.4  # strokes across the outline have half of themselves inside
MIX = 0.9  # of the color behind, in a stroke right at a lost outline; falls off quickly inside
FADE = 0.9  # loss of opacity: several strokes overlap
STRETCH = 0.3  # growth along the outline
SHRINK = 0.3  # shrinkage of a stroke across a found outline
SOLID, FAINT = 0.995, 2  # its opacity; exponent of its own opacity as a weight: faint strokes stay faint
APART, CLOSE = 0.04, 0.2  # OKLab lightness by which it is separated from the background, up to a difference

__all__ = ["Around", "Edges", "find_edges", "soften_edges"]


def find_edges(
    strokes: Gaussians,
    cameras: Sequence[Camera],
    around: Around,
    *,
    focus: Array | None = None,
    subject: Mask | None = None,
) -> Edges | None:
    """Find the role of strokes in the outline of the subject; None if no view has an outline.

    Args:
        strokes: k strokes, in their painted colors.
        cameras: of the job, of any size; of more than 8 every n-th. For a picture, its own and some near it.
        around: stage and ground behind them.
        focus: [k] larger in the focus, in any unit. None takes the upper part of the pictures.
        subject: [k] whether strokes belong to the subject and not to its ground, whose outline is not
            changed; None for all.
    """
    for name, values in (("focus", focus), ("subject", subject)):
        if values is not None:
            check("find_edges", means=(strokes.means, "k 3"), **{name: (values, "k")})
    count = len(strokes)
    if count == 0:
        return None
    lightness = oklab_of(base_colors(strokes.sh))[:, 0]
    says = [_spread(lightness), np.zeros(count) if focus is None else _spread(focus)]
    says.append(np.ones(count) if subject is None else subject.astype(np.float64))
    step = -(-len(cameras) // MOST_VIEWS) or 1
    told = np.stack(says, axis=1)
    all_views = view_by_view(lambda camera: view_of(strokes, camera, around, told), cameras[::step], count)
    views = [view for view in all_views if view is not None]
    if not views:
        return None
    missing = AIM - _lost(strokes, views[:: -(-len(views) // FITTED_VIEWS)])
    lose, find = min(max(missing / YIELD, 0), MOST), FOUND + max(-missing, 0)
    lost, found = hardness([view.outline for view in views], focus is not None, lose, find)
    return gathered(strokes, views, lost, found)


def _lost(strokes: Gaussians, views: Sequence[View]) -> float:
    """Share of the outlines of the subject that is already lost, all views together."""
    is_subject = np.concatenate([view.outline.says[:, 2] > 0.5 for view in views])
    lost = np.concatenate([view.is_lost_in(strokes) for view in views])[is_subject]
    return float(lost.mean()) if len(lost) else 0.0


def soften_edges(strokes: Gaussians, edges: Edges | None, strength: float = 1.0) -> Gaussians:
    """Soften and sharpen strokes at the outline of the subject.

    Args:
        strokes: the k strokes of `edges`.
        edges: see `find_edges`.
        strength: 0 to 1.

    Returns:
        The same strokes in the same order, with other scales, opacities and view-independent colors at the
        outline; the input itself if the strength is 0 or there are no edges.

    Raises:
        ValueError: if `strength` is out of range, or `edges` has another number of strokes.

    Example:
        >>> from brushgs.passes.form.edges import Around, find_edges, soften_edges
        >>> softer = soften_edges(strokes, find_edges(strokes, [camera], Around()))
        >>> len(softer) == len(strokes)
        True
    """
    if not 0 <= strength <= 1:
        raise ValueError(f"soften_edges: strength must be in [0, 1], got {strength:g}")
    if edges is None or strength == 0:
        return strokes
    check("soften_edges", means=(strokes.means, "k 3"), lost=(edges.lost, "k"))
    soft, crisp = (strength * np.minimum(GAIN * amount, 1) for amount in (edges.lost, edges.found))
    rows = np.flatnonzero((soft > 0) | (crisp > 0))
    if len(rows) == 0:
        return strokes
    part, soft, crisp = strokes.take(rows), soft[rows], crisp[rows]
    colors = base_colors(part.sh)
    lab = oklab_of(colors)
    toward = edges.behind[rows] - lab
    far = np.linalg.norm(toward, axis=1)
    mixed = lab + MIX * soft[:, None] ** 2 * toward
    mixed[:, 0] -= np.sign(toward[:, 0]) * crisp * np.clip(CLOSE - far, 0, APART)
    mixed = rgb_of_oklab(mixed)
    axes = rotation_matrices(part.quats)
    along, across = (
        np.einsum("kji,kjl,kli->ki", axes, form[rows], axes) for form in (edges.along, edges.across)
    )
    grown = (1 + STRETCH * soft[:, None] * along) * (1 - SHRINK * crisp[:, None] * across)
    sh, scales, opacities = strokes.sh.copy(), strokes.scales.copy(), strokes.opacities.copy()
    sh[rows] = shift_base_colors(part, np.clip(mixed, 0, 1) - colors).sh
    scales[rows] = np.minimum(part.scales * grown, np.finfo(scales.dtype).max)
    faded = part.opacities * (1 - FADE * soft)
    opacities[rows] = faded + crisp * faded**FAINT * np.maximum(SOLID - faded, 0)
    return replace(strokes, sh=sh, scales=scales, opacities=opacities)


def _spread(values: Array) -> F64:
    """[k] values normalized to 0 to 1."""
    values = values.astype(np.float64)
    low, high = float(values.min()), float(values.max())
    return np.asarray((values - low) / (high - low) if high > low else np.zeros(len(values)))
