"""Strokes -> the same strokes with lost and found edges: soft where the subject meets what is behind it.

A painter does not draw all of an outline: a third of it is lost, in the shade and where both sides have one
value, and it is hardest where one is to look. How hard it is, is found once for a job, in small views of it:

    hardness = contrast x light x focus

Its lowest part is lost: strokes there are stretched along the outline, let through what is behind them, the
more the nearer to the outline, and take of its colour. Its highest part in the focus is found: strokes do not
spill. Strokes keep what they got in all frames, so nothing changes as the camera moves.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from brushgs.arrays import F64, Array, Mask, check
from brushgs.colors import oklab_of, rgb_of_oklab
from brushgs.passes.edges.find import Edges, gathered, hardness
from brushgs.passes.edges.outline import Around, view_of
from brushgs.quats import rotation_matrices
from brushgs.scene import Camera, Gaussians
from brushgs.sh import base_colors, shift_base_colors

MOST_VIEWS = 8  # in which outlines are sought
GAIN = 1.4  # strokes over the outline have half of themselves inside
MIX = 0.6  # of the colour behind, in a stroke right at a lost outline
FADE = 0.9  # of the opacity, that it loses: several lie over each other
STRETCH = 0.3  # by which it grows along the outline
SHRINK = 0.15  # by which a stroke shrinks across a found outline
BETWEEN = 0.3  # of a lost edge, in all that is neither lost nor found

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
    """Find what strokes are to the outline of the subject; None where no view has an outline.

    Args:
        strokes: k strokes, in the colours in which they are painted.
        cameras: of the job, of any size; of more than 8 every n-th. Of a picture, its own and some near it.
        around: what they are seen against.
        light: [k] how much light falls on each, in any unit, such as normals times the direction of the lamp.
            None takes their lightness.
        focus: [k] more in the focus, in any unit. None takes the upper part of the pictures.
        subject: [k] whether strokes belong to the subject and not to its ground, whose outline is neither
            lost nor found; None for all.
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
    lost, found = hardness([view.outline for view in views], has_focus=focus is not None)
    return gathered(strokes, views, lost, found)


def soften_edges(strokes: Gaussians, edges: Edges | None, strength: float = 1.0) -> Gaussians:
    """Soften and sharpen strokes at the outline of the subject.

    Args:
        strokes: k strokes, those that the edges were found for.
        edges: see `find_edges`.
        strength: 0 to 1.

    Returns:
        The same strokes in the same order, with other scales, opacities and view-independent colours at the
        outline; the input itself where the strength is 0 or there are no edges.

    Raises:
        ValueError: if `strength` is out of range, or edges are those of another number of strokes.

    Example:
        >>> from brushgs.passes.edges import Around, find_edges, soften_edges
        >>> softer = soften_edges(strokes, find_edges(strokes, [camera], Around()))
        >>> bool((softer.opacities <= strokes.opacities).all())
        True
    """
    if not 0 <= strength <= 1:
        raise ValueError(f"soften_edges: strength must be in [0, 1], got {strength:g}")
    if edges is None or strength == 0:
        return strokes
    check("soften_edges", means=(strokes.means, "k 3"), lost=(edges.lost, "k"))
    between = BETWEEN * np.maximum(edges.near - edges.lost - edges.found, 0)
    soft = strength * np.minimum(GAIN * (edges.lost + between), 1)
    crisp = strength * np.minimum(GAIN * edges.found, 1)
    rows = np.flatnonzero((soft > 0) | (crisp > 0))
    if len(rows) == 0:
        return strokes
    part, soft, crisp = strokes.take(rows), soft[rows], crisp[rows]
    colors = base_colors(part.sh)
    lab = oklab_of(colors)
    mixed = rgb_of_oklab(lab + MIX * soft[:, None] * (edges.behind[rows] - lab))
    axes = rotation_matrices(part.quats)
    along, across = (
        np.einsum("kji,kjl,kli->ki", axes, form[rows], axes) for form in (edges.along, edges.across)
    )
    grown = (1 + STRETCH * soft[:, None] * along) * (1 - SHRINK * crisp[:, None] * across)
    sh, scales, opacities = strokes.sh.copy(), strokes.scales.copy(), strokes.opacities.copy()
    sh[rows] = shift_base_colors(part, np.clip(mixed, 0, 1) - colors).sh
    scales[rows] = np.minimum(part.scales * grown, np.finfo(scales.dtype).max)
    opacities[rows] = part.opacities * (1 - FADE * soft)
    return replace(strokes, sh=sh, scales=scales, opacities=opacities)


def _spread(values: Array) -> F64:
    """[k] from 0, the least of them, to 1."""
    values = values.astype(np.float64)
    low, high = float(values.min()), float(values.max())
    return np.asarray((values - low) / (high - low) if high > low else np.zeros(len(values)))
