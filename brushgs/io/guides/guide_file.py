"""What every format of guides gives: lines in space, and how far they reach."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from brushgs.errors import SceneError
from brushgs.values.arrays import F64, Rows

MAX_BYTES = 1 << 24  # of a file; 16 MiB are some 500,000 points, more than strokes
MAX_COORDINATE = 1e15  # world units, as for positions of cameras
CURE = "draw a line of two points or more"


@dataclass(frozen=True, eq=False)
class Guides:
    """Lines in space that strokes run along.

    Attributes:
        starts: [S, 3] where the segments of all lines begin, world units.
        ends: [S, 3] where they end; no segment has length zero.
        reach: distance, world units, > 0, within which strokes follow a guide: wholly on it, not at all from
            there on. None for a tenth of the radius of the scene.
    """

    starts: F64
    ends: F64
    reach: float | None = None


def guides_of(path: Path, points: F64, segments: Rows, reach: float | None) -> Guides:
    """The guides of a file.

    Args:
        path: the file, for messages.
        points: [P, 3].
        segments: [S, 2] rows of the points that each runs from and to.
        reach: see `Guides`; as the file states it.

    Raises:
        SceneError: if a number is not finite or too large, or there is no segment above length zero.
    """
    bad = ~(np.abs(points) <= MAX_COORDINATE).all(axis=1)
    if bad.any():
        row = int(bad.argmax())
        rule = f"must have finite coordinates up to {MAX_COORDINATE:g}"
        raise SceneError(path, f"point {row + 1} {rule}, got {points[row].tolist()}; correct it")
    if reach is not None and not 0 < reach <= MAX_COORDINATE:
        raise SceneError(
            path, f"'reach' must be a distance above 0 in world units, got {reach:g}; correct it"
        )
    starts, ends = points[segments[:, 0]], points[segments[:, 1]]
    is_long = (starts != ends).any(axis=1)
    if not is_long.any():
        raise SceneError(path, f"holds no line; {CURE}")
    return Guides(starts[is_long], ends[is_long], reach)
