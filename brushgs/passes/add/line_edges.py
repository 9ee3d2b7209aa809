"""Edge points of a plain picture with depth, where a person would draw a line, with subpixel precision.

An edge is a step of color (OKLab) or of disparity, the inverse of depth. Coincident steps of both add up, so
they give one line instead of two side by side. Slopes that continue over a wider window are shading or a
receding floor, and are subtracted. Texture has edges in all directions: an edge counts by the agreement of
the steps around it, or by its isolation.
Sources: Di Zenzo 1986 (gradient of several channels); Canny 1986 (maxima along the gradient, hysteresis);
Devernay 1995 (their place between pixels); Grigorescu et al. 2003 (suppression by the surround).
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from brushgs.passes.color.color_space import oklab_planes
from brushgs.values.arrays import F32, F64, Mask, Rows
from brushgs.values.frame import Frame

FINE = 1.4  # px, deviation of the smoothing: of captured scenes, less shows single Gaussians
SILHOUETTE = 1.8  # px, of depth: hair has one outline
RIDGE = 0.8  # px, of the size of steps: clipped steps form flat ridges, which would give two lines
STEP = 2.5 * FINE  # px: height of a smoothed step over its greatest slope
BORDER = 2  # px of the picture without edges
WIDE = 9  # px, the window in which steps must agree
SURROUND = 25  # px, the window in which an edge must stand out
SOLID = 0.5  # minimum alpha of a pixel that shows a surface
NEAREST = 0.05  # of the depth of the subject; smaller depths are clipped to this
CHROMA = 1.6  # weight of chroma, relative to lightness: a red mark on an equally light gray is visible
DISPARITY = 2.2  # of a step of disparity over that of the subject, in steps of lightness
LEAST_DISPARITY = 0.025  # of that of the subject: the depth of trained scenes is as rough as this
SURE_DISPARITY = 0.06  # above which an edge is surely an edge of depth
MOST_DISPARITY = 0.25  # maximum that counts
AGREED = 1.15  # inverse of the agreement of steps along a straight edge: makes that 1
TEXTURE = 1.0  # factor on the mean disagreeing step around, which an edge must exceed
ALONE = (2.0, 4.5)  # edge strength over the mean of the surround: from texture to an edge that stands alone


@dataclass(frozen=True, eq=False)
class EdgePoints:
    """E points of edges in a picture.

    Attributes:
        points: [E, 2] (x, y), pixels.
        normals: [E, 2] unit vectors across the edge, toward the far side of a step of depth.
        strengths: [E] step of lightness over the edge, about 0 to 1, less in texture.
        steps: [E] how far the edge is a step of depth, 0 to 1.
    """

    points: F64
    normals: F64
    strengths: F64
    steps: F64

    def __len__(self) -> int:
        return len(self.points)

    def take(self, rows: Rows | Mask) -> "EdgePoints":
        """Some of the points, in that order."""
        return EdgePoints(self.points[rows], self.normals[rows], self.strengths[rows], self.steps[rows])


@dataclass(frozen=True, eq=False)
class Picture:
    """The channels in which edges are found.

    Attributes:
        lab: [3, H, W] OKLab of the plain picture, over its own mean color.
        disparity: [H, W] inverse depth over that of the subject; 0 for empty pixels.
        alpha: [H, W] of the plain picture.
    """

    lab: F32
    disparity: F32
    alpha: F32

    @classmethod
    def of(cls, frame: Frame) -> "Picture":
        """A plain picture, with depth."""
        assert frame.depth is not None, "render the plain picture with depth"
        alpha = frame.alpha.astype(np.float32)
        premultiplied = frame.rgb.astype(np.float32)
        total = max(float(alpha.sum()), float(np.finfo(np.float32).tiny))
        mean = np.ones(alpha.size, np.float32) @ premultiplied.reshape(-1, 3) / np.float32(total)
        lab = oklab_planes(np.clip(premultiplied + (1 - alpha[..., None]) * mean, 0, 1))
        lab[1:] *= CHROMA
        depth = frame.depth.astype(np.float64)
        seen = depth[alpha > SOLID]
        middle = float(np.median(seen)) if len(seen) else 1.0
        disparity = _solidity(alpha) * (middle / np.maximum(depth, NEAREST * middle))
        return cls(lab, disparity.astype(np.float32), alpha)


def _solidity(alpha: F32) -> F32:
    """How far a pixel is solid enough to have an outline: fog has none."""
    return np.asarray(np.clip(1.5 * alpha - 0.5, 0, 1))


def edge_points(picture: Picture, *, least: float) -> EdgePoints:
    """Find the points of edges.

    Args:
        picture: see `Picture`.
        least: minimum strength of an edge.
    """
    full, half = _Tensor.zeros(picture.alpha.shape), _Tensor.zeros(picture.alpha[::2, ::2].shape)
    # Steps of color count if both sides are solid.
    shape = picture.alpha.shape
    solid = _doubled(_solidity(ndimage.minimum_filter(picture.alpha[::2, ::2], 3)), shape)
    for channel in picture.lab:
        y, x = _slopes(_smooth(channel))
        x *= solid
        y *= solid
        full.add(x, y)
        half.add(_mean(x[::2, ::2], WIDE // 2 + 1), _mean(y[::2, ::2], WIDE // 2 + 1))
    y, x = _slopes(_smooth(picture.disparity, SILHOUETTE))
    counted = DISPARITY * _counted(x, y)
    x *= counted
    y *= counted
    full.add(x, y)
    half.add(_mean(x[::2, ::2], WIDE // 2 + 1), _mean(y[::2, ::2], WIDE // 2 + 1))
    size = STEP * full.root()  # the height of a step
    coarse = size[::2, ::2]
    agreement = STEP * half.root() / np.maximum(_mean(coarse, WIDE // 2 + 1), 1e-6)
    alone = coarse / np.maximum(_mean(coarse, SURROUND // 2 + 1), 1e-6)
    alone = np.clip((alone - ALONE[0]) / (ALONE[1] - ALONE[0]), 0, 1)
    trust = np.maximum(np.minimum(AGREED * agreement, 1) ** 2, alone)
    texture = TEXTURE * _mean(coarse * (1 - trust), SURROUND // 2 + 1)
    trust *= 1 - np.minimum(texture / np.maximum(coarse, 1e-6), 1)
    near_side = ndimage.maximum_filter(picture.alpha[::2, ::2], WIDE // 2)
    strength = size * _doubled(trust * np.clip(2 * near_side - 1, 0, 1), size.shape)
    return _maxima(size, strength, full, (x, y), least)


def _counted(x: F32, y: F32) -> F32:
    """The factor of each slope of disparity, without slopes of a floor and without noise, and clipped."""
    shape = x.shape
    mean_x, mean_y = (_doubled(_mean(v[::2, ::2], SURROUND // 2 + 1), shape) for v in (x, y))
    size = np.maximum(np.hypot(x, y), 1e-9)
    along = np.maximum(x * mean_x + y * mean_y, 0) / size
    step = STEP * np.maximum(size - along, 0)
    step = np.maximum(step - LEAST_DISPARITY, 0)
    counted = step / (1 + step / MOST_DISPARITY) / (STEP * size)
    return np.asarray(counted, np.float32)


@dataclass(eq=False)
class _Tensor:
    """The sum of gradient x gradient over channels, [H, W] each."""

    xx: F32
    xy: F32
    yy: F32

    @classmethod
    def zeros(cls, shape: tuple[int, ...]) -> "_Tensor":
        return cls(*np.zeros((3, *shape), np.float32))

    def add(self, x: F32, y: F32) -> None:
        self.xx += x * x
        self.xy += x * y
        self.yy += y * y

    def root(self) -> F32:
        """The root of the larger eigenvalue: the length of the gradient of a single channel."""
        xx, xy, yy = self.xx, self.xy, self.yy
        return np.asarray(np.sqrt(0.5 * (xx + yy + np.sqrt((xx - yy) ** 2 + 4 * xy * xy))))

    def directions(self, rows: Rows, columns: Rows) -> F32:
        """[E, 2] unit vectors (x, y) of the gradient at some pixels, of either sign."""
        xx, xy, yy = (v[rows, columns] for v in (self.xx, self.xy, self.yy))
        angles = 0.5 * np.arctan2(2 * xy, xx - yy)
        return np.stack([np.cos(angles), np.sin(angles)], axis=1)


def _smooth(values: F32, deviation: float = FINE) -> F32:
    return np.asarray(ndimage.gaussian_filter(values, deviation, mode="nearest", truncate=2.5))


def _doubled(values: F32, shape: tuple[int, ...]) -> F32:
    """Upsample values of every other pixel to all pixels."""
    return values.repeat(2, axis=0)[: shape[0]].repeat(2, axis=1)[:, : shape[1]]


def _maxima(size: F32, strength: F32, tensor: _Tensor, depth: tuple[F32, F32], least: float) -> EdgePoints:
    """The points of maximum step along the gradient.

    Args:
        size: [H, W] height of steps.
        strength: [H, W] the same without texture.
        tensor: of the gradient.
        depth: [H, W] both slopes of disparity, weighted.
        least: minimum strength of a point.
    """
    is_inside = np.zeros(size.shape, bool)
    is_inside[BORDER:-BORDER, BORDER:-BORDER] = strength[BORDER:-BORDER, BORDER:-BORDER] > least
    rows, columns = np.nonzero(is_inside)
    normals = tensor.directions(rows, columns)
    places, across = np.stack([rows, columns]).astype(np.float32), normals.T[::-1]
    size = _smooth(size, RIDGE)
    here = size[rows, columns]
    after, before = (
        ndimage.map_coordinates(size, places + sign * across, order=1, mode="nearest") for sign in (1, -1)
    )
    kept = np.flatnonzero((here >= before) & (here > after))
    rows, columns = rows[kept], columns[kept]
    normals, here, after, before = (v[kept] for v in (normals, here, after, before))
    shifts = np.clip(0.5 * (after - before) / np.maximum(2 * here - before - after, 1e-9), -0.5, 0.5)
    points = np.stack([columns, rows], axis=1) + 0.5 + shifts[:, None] * normals
    falls = STEP * (depth[0][rows, columns] * normals[:, 0] + depth[1][rows, columns] * normals[:, 1])
    normals = normals * np.where(falls > 0, -1, 1)[:, None]  # disparity falls to the far side
    steps = np.minimum(np.abs(falls) / (DISPARITY * SURE_DISPARITY), 1)
    columns_of = (points, normals, strength[rows, columns], steps)
    return EdgePoints(*(column.astype(np.float64) for column in columns_of))


def _slopes(values: F32) -> tuple[F32, F32]:
    """Central differences down and to the right, [H, W] each."""
    down, right = np.zeros_like(values), np.zeros_like(values)
    if values.shape[0] > 2:
        down[1:-1] = 0.5 * (values[2:] - values[:-2])
    if values.shape[1] > 2:
        right[:, 1:-1] = 0.5 * (values[:, 2:] - values[:, :-2])
    return down, right


def _mean(values: F32, side: int) -> F32:
    """The mean of a window around each pixel."""
    return np.asarray(ndimage.uniform_filter(values, side, mode="nearest"))
