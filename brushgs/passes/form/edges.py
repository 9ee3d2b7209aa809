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
from dataclasses import replace

import numpy as np

from brushgs.passes.form.find_edges import Edges, gathered, hardness
from brushgs.passes.form.outline import Around, View, view_of
from brushgs.values.arrays import F64, Array, Mask, check
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices
from brushgs.values.sh import base_colors, shift_base_colors

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
    light: Array | None = None,
    focus: Array | None = None,
    subject: Mask | None = None,
) -> Edges | None:
    """Find the role of strokes in the outline of the subject; None if no view has an outline.

    Args:
        strokes: k strokes, in their painted colors.
        cameras: of the job, of any size; of more than 8 every n-th. For a picture, its own and some near it.
        around: stage and ground behind them.
        light: [k] light on each, in any unit, such as normals times the direction of the lamp. None takes
            their lightness.
        focus: [k] larger in the focus, in any unit. None takes the upper part of the pictures.
        subject: [k] whether strokes belong to the subject and not to its ground, whose outline is not
            changed; None for all.
    """
    for name, values in (("light", light), ("focus", focus), ("subject", subject)):
        if values is not None:
            check("find_edges", means=(strokes.means, "k 3"), **{name: (values, "k")})
    count = len(strokes)
    if count == 0:
        return None
    lightness = oklab_of(base_colors(strokes.sh))[:, 0] if light is None else light
    says = [_spread(lightness), np.zeros(count) if focus is None else _spread(focus)]
    says.append(np.ones(count) if subject is None else subject.astype(np.float64))
    step = -(-len(cameras) // MOST_VIEWS) or 1
    all_views = [view_of(strokes, camera, around, np.stack(says, axis=1)) for camera in cameras[::step]]
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
