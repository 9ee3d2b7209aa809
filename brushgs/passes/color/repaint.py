"""Fit the colors of strokes to pictures of the scene.

A stroke hides what is behind it, while the Gaussians it was merged from let light through, so merged colors
are not the visible ones. A picture is a sum of weight x color over strokes: the best colors are a linear
least squares problem, solved by simultaneous iterative reconstruction. Each stroke moves by the mean
difference between plain and painted picture over its pixels, weighted by its weights. That never overshoots,
since the weights of a pixel sum to at most 1.
Source: Gilbert 1972, Iterative methods for the three-dimensional reconstruction of an object from
projections.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.texture import StrokeTexture
from brushgs.passes.groups import add_rows
from brushgs.rendering.options import RenderOptions, draw_with
from brushgs.rendering.plain import PlainViews
from brushgs.rendering.view_by_view import view_by_view
from brushgs.rendering.visibility import painted_sums
from brushgs.values.arrays import Array
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import shift_base_colors

NUM_STEPS = 2  # the first gains 1 to 3 dB, the second 0.1 to 0.3, two more 0.1 where views were used only
ENOUGH_PAINT = 0.5  # pixels, over all views; strokes that paint less are left alone


def repaint(
    strokes: Gaussians,
    gaussians: Gaussians,
    views: Sequence[Camera] | PlainViews,
    *,
    num_steps: int = NUM_STEPS,
) -> Gaussians:
    """Fit stroke colors to plain pictures of the scene.

    Only the view-independent part of a color changes. Strokes are drawn as flat dabs, so that the colors
    suit any stroke image.

    Args:
        strokes: k strokes.
        gaussians: the scene that they were made of.
        views: a few small cameras (see `plain_views`), or plain pictures of the scene.
        num_steps: >= 0.

    Returns:
        The strokes in new colors; strokes that no view shows stay unchanged.

    Raises:
        ValueError: if there is no view.

    Example:
        >>> views = bg.plain_views(gaussians, [camera])
        >>> bg.repaint(strokes, gaussians, views)
        Gaussians(500, SH 3)
    """
    plain = PlainViews.of(gaussians, views)
    if len(plain) == 0:
        raise ValueError("repaint: views must have at least one camera, got none")
    for _ in range(num_steps if len(strokes) else 0):
        strokes = _step(strokes, plain)
    return strokes


def _step(strokes: Gaussians, views: PlainViews) -> Gaussians:
    kernel = StrokeTexture.open("ellipse")
    options = RenderOptions.of(kernel, depth=False)
    differences, shares = np.zeros((len(strokes), 3)), np.zeros(len(strokes))

    def look(view: tuple[Camera, Frame]) -> tuple[NDArray[np.int32], Array, Array]:
        camera, plain = view
        boxes, painted = draw_with(strokes, camera, kernel, options)
        return boxes.ids, *painted_sums(boxes, kernel, *_color_differences(plain, painted))

    for ids, sums, areas in view_by_view(look, views.pairs(), len(strokes)):
        add_rows(differences, ids, sums)
        add_rows(shares, ids, areas)
    known = np.minimum(shares / ENOUGH_PAINT, 1)
    steps = known[:, None] * differences / np.maximum(shares, 1e-12)[:, None]
    return shift_base_colors(strokes, steps)


def _color_differences(plain: Frame, painted: Frame) -> tuple[Array, Array]:
    """Color differences where both pictures are painted [H, W, 3], and that share of each pixel [H, W].

    Pixels that are empty in one picture do not count.
    """
    both = plain.alpha * painted.alpha
    difference = plain.rgb * painted.alpha[..., None] - painted.rgb * plain.alpha[..., None]
    return difference, both
