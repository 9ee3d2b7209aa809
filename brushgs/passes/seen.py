"""Visibility of each Gaussian in views: its area, and the color of the pictures at its position.

An invisible Gaussian needs no stroke, and a stroke of solid paint should have the color of the pictures at
its position, not the mean color of its members: for faint highlights over dark skin that would be white
flecks.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.texture import StrokeTexture
from brushgs.passes.groups import add_rows
from brushgs.rendering.options import RenderOptions, project_with
from brushgs.rendering.plain import PlainViews
from brushgs.rendering.view_by_view import view_by_view
from brushgs.rendering.visibility import painted_shares, painted_sums
from brushgs.values.arrays import Array
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import shift_base_colors

SURE_AREA = 0.02  # pixels a view; for smaller areas, mostly covered by others, the color is partly its own
VISIBLE_POWER = 0.5  # of areas in k-means; with 0.375 and 0.65 seven scenes are within 0.1 dB
LEAST_WEIGHT = 1e-2  # of the largest: other views may show Gaussians that these do not


@dataclass(frozen=True, eq=False)
class Seen:
    """Visibility of N Gaussians in views.

    Attributes:
        areas: [N] visible area of each, mean over the views, pixels, >= 0.
        gaussians: the Gaussians in the colors of the pictures at their positions.
    """

    areas: NDArray[np.float64]
    gaussians: Gaussians

    def weights(self, focus: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """[N] weights in k-means, relative to the largest, above 0.

        Args:
            focus: [N] > 0, factor on the strokes per area at each Gaussian.
        """
        weights = (self.areas / self.areas.max()) ** VISIBLE_POWER + LEAST_WEIGHT
        return weights if focus is None else np.asarray(weights * focus)


def seen_in(gaussians: Gaussians, views: PlainViews) -> Seen | None:
    """Measure the visibility of each Gaussian exactly, by its blending weights in pictures.

    Args:
        gaussians: N Gaussians.
        views: of their scene, of which they are the larger part.

    Returns:
        The visibility; None if no view shows any of them.
    """
    kernel = StrokeTexture.open("gaussian")
    areas, away = np.zeros(len(gaussians)), np.zeros((len(gaussians), 3))

    def look(view: tuple[Camera, Frame]) -> tuple[NDArray[np.int32], Array, Array]:
        camera, plain = view
        boxes, _ = project_with(gaussians, camera, RenderOptions.of(kernel))
        colors = plain.rgb / np.maximum(plain.alpha, 1e-6)[..., None]
        sums, shares = painted_sums(boxes, kernel, colors, np.ones_like(plain.alpha))
        return boxes.ids, shares, sums - shares[:, None] * boxes.colors

    for ids, shares, differences in view_by_view(look, views.pairs(), len(gaussians)):
        add_rows(areas, ids, shares)
        add_rows(away, ids, differences)
    if not areas.max(initial=0) > 0:
        return None
    sure = np.minimum(areas / (SURE_AREA * len(views)), 1)
    steps = sure[:, None] * away / np.maximum(areas, 1e-12)[:, None]
    return Seen(areas / len(views), shift_base_colors(gaussians, steps))


def shown_areas(
    gaussians: Gaussians, cameras: Sequence[Camera], *, kernel: Literal["ellipse", "gaussian"] = "ellipse"
) -> NDArray[np.float64]:
    """[N] visible area of each stroke, mean over some cameras, pixels.

    Args:
        gaussians: N strokes.
        cameras: the mean over none is 0.
        kernel: what strokes are drawn as; ellipses are about as large as strokes are.
    """
    texture = StrokeTexture.open(kernel)
    areas = np.zeros(len(gaussians))

    def look(camera: Camera) -> tuple[NDArray[np.int32], Array]:
        boxes, _ = project_with(gaussians, camera, RenderOptions.of(texture))
        size = camera.height, camera.width
        return boxes.ids, painted_shares(boxes, texture, np.ones(size))

    for ids, shares in view_by_view(look, cameras, len(gaussians)):
        add_rows(areas, ids, shares)
    return areas / max(len(cameras), 1)


def some_small(cameras: Sequence[Camera], most: int, side: int) -> list[Camera]:
    """At most `most` cameras, evenly spread, with at most `side` pixels on the longer side."""
    rows = np.unique(np.linspace(0, len(cameras) - 1, min(len(cameras), most)).round().astype(int))
    chosen = (cameras[row] for row in rows)
    return [camera.in_side(min(side, max(camera.width, camera.height))) for camera in chosen]
