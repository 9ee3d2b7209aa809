"""Flicker: difference of a picture from an earlier one that is moved to its view by exact depth and pose.

Everything here measures pictures and paints nothing, so any renderer can be measured. Where depth, alpha or a
picture is "plain" it is that of the whole scene drawn with the built-in `gaussian` kernel: the best available
estimate of the captured surface. Pictures are [H, W, 3], display-encoded, on their background.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import F64, Array, check
from brushgs.values.camera import Camera

PLAIN_ALPHA = 0.5  # minimum alpha of a plain pixel that shows a surface
DEPTH_TOLERANCE = 0.01  # of the depth: a larger difference between two views means two surfaces
WORST = 0.01  # share of the pixels with the largest error, which are the most visible


@dataclass(frozen=True, eq=False)
class View:
    """A picture, and the surface behind each of its pixels.

    Attributes:
        rgb: [H, W, 3] the picture to measure, on its background.
        depth: [H, W] camera z of the plain picture, world units.
        alpha: [H, W] of the plain picture, 0 to 1.
        camera: of both.

    Raises:
        ValueError: if a shape does not fit the camera's size.
    """

    rgb: Array  # [H, W, 3]
    depth: Array  # [H, W]
    alpha: Array  # [H, W]
    camera: Camera

    def __post_init__(self) -> None:
        size = f"{self.camera.height} {self.camera.width}"
        check("View", rgb=(self.rgb, f"{size} 3"), depth=(self.depth, size), alpha=(self.alpha, size))


@dataclass(frozen=True, eq=False)
class WarpError:
    """The difference of a picture from another one that is moved to its view.

    Attributes:
        rmse: root of the mean squared error over valid pixels and channels, 0 to 1.
        worst_1pct: the same over the 1 % of valid pixels (at least one) of largest error.
        valid_share: valid pixels over all pixels of the second view.
        squared_error: [H, W] float32 mean over the channels, NaN where not valid; None if not requested.
    """

    rmse: float
    worst_1pct: float
    valid_share: float
    squared_error: NDArray[np.float32] | None = None


@dataclass(frozen=True, eq=False)
class ViewMatch:
    """The position of each valid pixel of a second view in a first one, see `match_views`.

    Attributes:
        first_size: (height, width) of the first picture.
        second_size: (height, width) of the second picture.
        pixels: [n] valid pixels of the second view, flat.
        corners: [n] upper left of the four pixels of the first view, flat.
        shares: [n, 2] weights of the right and of the lower pixels, 0 to 1.
    """

    first_size: tuple[int, int]
    second_size: tuple[int, int]
    pixels: NDArray[np.int64]  # [n]
    corners: NDArray[np.int64]  # [n]
    shares: NDArray[np.float32]  # [n, 2]

    def moved(self, first: Array) -> Array:
        """[n, 3] the first picture moved to the second view, at its valid pixels."""
        check("moved", first=(first, f"{self.first_size[0]} {self.first_size[1]} 3"))
        colors, width = first.reshape(-1, 3), self.first_size[1]
        right, down = self.shares[:, :1], self.shares[:, 1:]
        above, above_right, below, below_right = (
            colors.take(self.corners + offset, axis=0) for offset in (0, 1, width, width + 1)
        )
        above += (above_right - above) * right
        below += (below_right - below) * right
        return np.asarray(above + (below - above) * down)

    def error(self, first: Array, second: Array, *, keep_map: bool = False) -> WarpError:
        """Flicker between two pictures [H, W, 3] of these views; with `keep_map` that of each pixel too."""
        height, width = self.second_size
        check("error", second=(second, f"{height} {width} 3"))
        difference = self.moved(first) - second.reshape(-1, 3).take(self.pixels, axis=0)
        squares = np.einsum("pc,pc->p", difference, difference) / 3
        num_worst = max(1, round(WORST * len(squares))) if len(squares) else 0
        worst = np.partition(squares, len(squares) - num_worst)[len(squares) - num_worst :]
        error_map = None
        if keep_map:
            error_map = np.full((height, width), np.nan, np.float32)
            error_map.reshape(-1)[self.pixels] = squares
        rmse, worst_rmse = (
            float(np.sqrt(s.mean(dtype=np.float64))) if len(s) else 0.0 for s in (squares, worst)
        )
        return WarpError(rmse, worst_rmse, len(squares) / (height * width), error_map)


def match_views(first: View, second: View, displacement: Array | None = None) -> ViewMatch:
    """Find the valid pixels of a pair of views by plain depth and alpha, to compare pictures of them.

    The center of each pixel of the second view is unprojected with its plain depth and projected by the
    first camera; there the first picture is sampled bilinearly. A pixel is valid if
    - the plain alpha is above 0.5 there and at all four pixels of the first view that are sampled,
    - these four lie inside the first picture,
    - the point is not hidden in the first view: the plain depth of each of the four differs from the depth
      of the point by at most 1 %.
    So outlines, surfaces that only one view sees, and paint beyond an outline are not measured. Bilinear
    sampling blurs, so even the plain picture has an error above zero. What strokes add is the "excess": the
    `rmse` of the painting minus that of the plain picture for the same pair of views (per pair first, then
    the mean over a sequence). At gap g of a sequence the pairs are the frames (k, k + g). Source: Lai et al.
    2018 (warping error), with exact depth and pose in place of estimated optical flow.

    Args:
        first: the earlier view.
        second: the later view, of any size.
        displacement: [H, W, 3] for a moving scene: from the position of the surface of each pixel of the
            second view to its position at the time of the first, world units, see `displacements` in
            `brushgs.measure.flow`; the point of a pixel is moved by it before projection. None for a still
            scene.
    """
    height, width = first.depth.shape
    pixels = np.flatnonzero((second.alpha > PLAIN_ALPHA) & (second.depth > 0))
    steps = None
    if displacement is not None:
        check("match_views", displacement=(displacement, f"{second.camera.height} {second.camera.width} 3"))
        steps = displacement.reshape(-1, 3)[pixels]
    rows, columns = np.divmod(pixels, second.camera.width)
    centers = columns + 0.5, rows + 0.5
    x, y, z = points_seen(first.camera, second.camera, centers, second.depth.reshape(-1)[pixels], steps)
    x, y = x - 0.5, y - 0.5  # from here on pixel centers are whole numbers
    is_inside = (z > 0) & (x >= 0) & (x < width - 1) & (y >= 0) & (y < height - 1)
    pixels, x, y, z = pixels[is_inside], x[is_inside], y[is_inside], z[is_inside]
    left, top = x.astype(np.int64), y.astype(np.int64)
    corners = top * width + left
    # The depth of an unpainted pixel agrees with no other.
    depth = np.where(first.alpha > PLAIN_ALPHA, first.depth, -np.inf).reshape(-1)
    is_seen = np.ones(len(z), np.bool_)
    for offset in (0, 1, width, width + 1):
        is_seen &= np.abs(depth[corners + offset] - z) <= DEPTH_TOLERANCE * z
    shares = np.stack([x - left, y - top], axis=1)[is_seen].astype(np.float32)
    second_size = second.depth.shape[0], second.depth.shape[1]
    return ViewMatch((height, width), second_size, pixels[is_seen], corners[is_seen], shares)


def points_seen(
    first: Camera,
    second: Camera,
    centers: Sequence[F64] | F64,
    depths: Array,
    steps: Array | None = None,
) -> tuple[F64, F64, F64]:
    """Project points of the second camera's picture to the first camera.

    Args:
        first: the camera to project to.
        second: the camera of the points.
        centers: x [n] and y [n] in that picture, pixels.
        depths: [n] camera z there, world units.
        steps: [n, 3] added to the points before projection, world units; or None.

    Returns:
        [n] x, [n] y in pixels, and [n] camera z; x and y are undefined where z <= 0.
    """
    move = first.viewmat @ np.linalg.inv(second.viewmat)
    per_pixel, shift = first.K @ move[:3, :3] @ np.linalg.inv(second.K), first.K @ move[:3, 3]
    columns, rows = centers
    x, y, z = (
        (a * columns + b * rows + c) * depths + d for (a, b, c), d in zip(per_pixel, shift, strict=True)
    )
    if steps is not None:
        dx, dy, dz = first.K @ first.viewmat[:3, :3] @ steps.T
        x, y, z = x + dx, y + dy, z + dz
    inverse = 1 / np.where(z > 0, z, 1.0)
    return x * inverse, y * inverse, z
