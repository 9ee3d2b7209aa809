"""The motion of strokes in a page: their poses at key moments, in numbers of 16 bits.

A page moves strokes as `Pose.moved` does. Keys are every second frame of a film; between them shifts follow a
cubic Hermite spline (Catmull-Rom), all else a line. Each key is stored as its difference from the one before:
gzip then takes little for what rests.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.pipeline.moving import Moving
from brushgs.rendering.canvas import Painting
from brushgs.rendering.motion import COLOR, NUM_NUMBERS, SHIFT, TURN, match
from brushgs.values.arrays import F32, F64, Rows
from brushgs.values.gaussians import Gaussians

EVERY = 2  # frames from key to key
LEVELS = 65535  # of a shift; others have those of 12 bits
OTHER_LEVELS = 4095


@dataclass(frozen=True, eq=False)
class PageMotion:
    """The motion of a painting, at key moments.

    Attributes:
        moving: of the painting.
        frames: [K] frames of its film that are keys, ascending; the first is 0.
    """

    moving: Moving
    frames: Rows

    @classmethod
    def of(cls, moving: Moving) -> "PageMotion":
        """With a key every second frame, and the last."""
        last = len(moving.film.times) - 1
        return cls(moving, np.unique([*range(0, last + 1, EVERY), last]))

    def first(self, painting: Painting) -> Painting:
        """A painting at the first moment."""
        return painting.posed(self.moving.pose(0), takes_light=self.moving.takes_light)

    @property
    def times(self) -> F64:
        """[K] seconds from the start."""
        return np.asarray(self.frames / self.moving.film.fps)

    def of_coat(
        self, strokes: Gaussians, page_rows: Rows, origin: F64
    ) -> tuple[dict[str, Any], dict[str, NDArray[Any]]] | None:
        """The header and the columns of a coat; None if none of its strokes moves.

        Args:
            strokes: of the coat, N.
            page_rows: [n] the row of `strokes` that each row of the page is.
            origin: [3] of the page, world units.

        Returns:
            The header has `steps` and `lows`, 12 numbers each: number = low + step x code. Columns: `movers`
            [m], rows of the page; `pivots` [m, 3], page coordinates; `poses` [K, m, 12], differences of
            codes.
        """
        motion = self.moving.motion
        rows, found = match(strokes, motion.ids)
        row_of = np.full(len(strokes), -1)
        row_of[page_rows] = np.arange(len(page_rows))
        is_shown = row_of[rows] >= 0
        rows, found = rows[is_shown], found[is_shown]
        if len(rows) == 0:
            return None
        poses = np.stack([self.moving.pose(int(frame)).numbers[found] for frame in self.frames])
        if not self.moving.takes_light:
            poses[..., COLOR] = 0
        codes, lows, steps = _codes(poses)
        differences = np.diff(codes, axis=0, prepend=np.zeros_like(codes[:1]))
        columns = {
            "movers": row_of[rows].astype(np.float32),
            "pivots": (motion.pivots[found] - origin).astype(np.float32),
            "poses": differences,  # wraps
        }
        return {"lows": lows.tolist(), "steps": steps.tolist()}, columns


def _codes(poses: F32) -> tuple[NDArray[np.uint16], F64, F64]:
    """[K, m, 12] codes, and the lowest value and the step of each number.

    The three numbers of a shift have one step, and so have the four of a turn.
    """
    flat = poses.reshape(-1, NUM_NUMBERS).astype(np.float64)
    lows, highs = flat.min(axis=0), flat.max(axis=0)
    ranges = highs - lows
    ranges[SHIFT], ranges[TURN] = ranges[SHIFT].max(), ranges[TURN].max()
    levels = np.full(NUM_NUMBERS, float(OTHER_LEVELS))
    levels[SHIFT] = LEVELS
    steps = np.where(ranges > 0, ranges / levels, 1.0)
    codes = np.rint((poses - lows) / steps).clip(0, LEVELS).astype(np.uint16)
    return codes, lows, steps
