"""A line that was drawn with a brush -> its paint as a picture."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d, map_coordinates
from scipy.spatial import cKDTree

from brushgs.brushes.texture import StrokeTexture
from brushgs.values.arrays import F32, F64, Mask

STEP = 1.5  # px between places of a line
SOFT = 2.0  # places over which the line of a hand is smoothed
END = 0.3  # share of a stroke image at each end that is not stretched with the line
LEAST_WIDTH, MORE_WIDTH = 0.4, 1.2  # of the size, without pressure, and by which full pressure adds to it


@dataclass(frozen=True, eq=False)
class Ribbon:
    """A line in a picture, as wide as the brush.

    Attributes:
        points: [n, 2] px, at even steps; n >= 2.
        tangents: [n, 2] unit vectors.
        halves: [n] half widths, px.
        at: [n] place of each along the given points, 0 to their number - 1.
    """

    points: F64
    tangents: F64
    halves: F64
    at: F64

    @classmethod
    def of(cls, drawn: F64, size: float) -> "Ribbon":
        """From what a pointer told.

        Args:
            drawn: [m, 3] x and y, px, and pressure, 0 to 1; m >= 1. One place makes a dab as long as wide.
            size: width at half pressure, px.
        """
        line = drawn.astype(np.float64)
        steps = np.linalg.norm(np.diff(line[:, :2], axis=0), axis=1)
        if steps.sum() < 1:
            half = np.array([size / 2, 0, 0])
            line, at = np.stack([line[0] - half, line[0] + half]), np.zeros(2)
        else:
            keep = np.concatenate([[True], steps > 1e-6])
            line, at = line[keep], np.flatnonzero(keep).astype(np.float64)
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line[:, :2], axis=0), axis=1))])
        places = np.linspace(0, along[-1], max(int(np.ceil(along[-1] / STEP)) + 1, 2))
        even = np.stack([np.interp(places, along, line[:, k]) for k in range(3)], axis=1)
        ends = even[[0, -1]]
        even = gaussian_filter1d(even, SOFT, axis=0, mode="nearest")
        even[[0, -1]] = ends
        tangents = np.gradient(even[:, :2], axis=0)
        tangents /= np.maximum(np.linalg.norm(tangents, axis=1, keepdims=True), 1e-9)
        halves = size / 2 * (LEAST_WIDTH + MORE_WIDTH * np.clip(even[:, 2], 0, 1))
        return cls(even[:, :2], tangents, halves, np.interp(places, along, at))

    def area(self, width: int, height: int) -> Mask:
        """[height, width] what the round end of the brush passed over."""
        area = np.zeros((height, width), bool)
        rows, columns, nearest, distance = self._near(width, height)
        inside = distance <= self.halves[nearest]
        area[rows[inside], columns[inside]] = True
        return area

    def paint(self, texture: StrokeTexture, colors: F64, opacity: float, width: int, height: int) -> F32:
        """[height, width, 4] straight alpha, 0 to 1: the stroke image bent along the line.

        Args:
            texture: a stroke image, or a kernel, which is taken as a plain soft line.
            colors: [m, 3] of the given points, 0 to 1; or [1, 3].
            opacity: 0 to 1, of full coverage.
            width: of the picture.
            height: likewise.
        """
        paint = np.zeros((height, width, 4), np.float32)
        rows, columns, nearest, _ = self._near(width, height)
        offsets = np.stack([columns + 0.5, rows + 0.5], axis=1) - self.points[nearest]
        tangents, half = self.tangents[nearest], self.halves[nearest]
        away = offsets[:, 1] * tangents[:, 0] - offsets[:, 0] * tangents[:, 1]
        steps = np.linalg.norm(np.diff(self.points, axis=0), axis=1)
        places = np.concatenate([[0.0], np.cumsum(steps)])
        along = places[nearest] + (offsets * tangents).sum(axis=1)
        v = away / half
        if texture.kind == "image":
            h, w = texture.coverage.shape
            u = _unstretched(along, places[-1], 2 * float(self.halves.mean()) * w / h)
            at = np.stack([(v + 1) / 2 * (h - 1), u * (w - 1)])
            coverage = (
                map_coordinates(texture.coverage.astype(np.float64), at, order=1, mode="constant") / 255
            )
        else:
            outside = np.maximum(np.maximum(-along, along - places[-1]), 0) / half
            coverage = np.exp(-4.5 * np.minimum(v**2 + outside**2, 9))
        coverage[np.abs(v) > 1] = 0
        paint[rows, columns, 3] = opacity * coverage
        given = self.at[nearest] if len(colors) > 1 else np.zeros(len(nearest))
        for channel in range(3):
            column = colors[:, channel]
            paint[rows, columns, channel] = np.interp(given, np.arange(len(column)), column)
        return paint

    def _near(self, width: int, height: int) -> tuple[F64, F64, F64, F64]:
        """Rows and columns of the pixels that the brush may reach, the nearest place, and its distance."""
        reach = float(self.halves.max())
        low = np.floor(np.clip(self.points.min(axis=0) - reach - 1, 0, [width, height])).astype(int)
        high = np.ceil(np.clip(self.points.max(axis=0) + reach + 1, 0, [width, height])).astype(int)
        rows, columns = np.mgrid[low[1] : high[1], low[0] : high[0]].reshape(2, -1)
        pixels = np.stack([columns + 0.5, rows + 0.5], axis=1)
        distance, nearest = cKDTree(self.points).query(pixels, distance_upper_bound=reach + 1)
        found = np.isfinite(distance)
        return rows[found], columns[found], nearest[found], distance[found]


def _unstretched(along: F64, length: float, natural: float) -> F64:
    """Places along a line -> places of a stroke image, 0 to 1, whose ends keep their shape."""
    if length <= natural:
        return along / length
    end = END * natural
    return np.interp(along, [0, end, length - end, length], [0, END, 1 - END, 1], left=-1.0, right=2.0)
