"""Underpaint: a soft copy behind each stroke that closes the gaps between strokes.

With it strokes may be drawn smaller. Its distance is the column `setbacks` of `Boxes`, filled by `project`;
its size and opacity are set here for all boxes.
"""

from dataclasses import dataclass
from math import inf
from typing import Any, Self

import numpy as np

from brushgs.brushes.brush_set import BrushSet, Sigmas, per_row
from brushgs.rendering.constants import GAUSSIAN_SIGMAS
from brushgs.values.arrays import F64
from brushgs.values.boxes import Boxes

# Mean PSNR of five captured scenes with the stroke "flat" and views, at the picture and on an unused ring:
# 26.2/26.3 dB without underpaint; 25.9/26.1 with size 1.2, and a halo around every silhouette; 27.1/26.8 with
# 1.0; 26.5/26.3 with 0.85. A reach of 0.82 gains 0.1 more and looks softer. Hard strokes in place of the soft
# kernel lose 1.4 to 3 dB.
SIZE = 1.0  # standard deviation of the kernel over that of the Gaussian
OPACITY = 0.9  # over that of the stroke; hardly matters
STROKE_REACH = 0.88  # reach of a stroke over underpaint, relative to its reach without


@dataclass(frozen=True)
class Underpaint:
    """Size and opacity of underpaint relative to its stroke; color, position and direction are the same.

    Attributes:
        reach: half extents of the soft kernel over those of the stroke's box, > 0; it is cut at three
            standard deviations, like the kernel "gaussian". One number, or one for each brush of a set.
        opacity: over that of the stroke, in (0, 1].

    Raises:
        ValueError: if a value is out of range.
    """

    reach: float | tuple[float, ...]
    opacity: float = OPACITY

    def __post_init__(self) -> None:
        if not all(0 < reach < inf for reach in np.atleast_1d(self.reach)):
            raise ValueError(f"Underpaint: reach must be positive and finite, got {self.reach}")
        if not 0 < self.opacity <= 1:
            raise ValueError(f"Underpaint: opacity must be above 0 to 1, got {self.opacity}")

    @classmethod
    def for_sigmas(cls, num_sigmas: Sigmas) -> Self:
        """Underpaint of `SIZE` times the Gaussian, for boxes of `num_sigmas` standard deviations."""
        if isinstance(num_sigmas, tuple):
            return cls(reach=tuple(SIZE * GAUSSIAN_SIGMAS / sigmas for sigmas in num_sigmas))
        return cls(reach=SIZE * GAUSSIAN_SIGMAS / num_sigmas)

    def reaches(self, boxes: Boxes) -> F64 | None:
        """[M] reach of each box; None if it is equal for all.

        Raises:
            ValueError: if a brush has no reach.
        """
        if not isinstance(self.reach, tuple):
            return None
        return per_row("Underpaint", self.reach, boxes.brushes, len(boxes))


def underpaint_arguments(
    where: str, boxes: Boxes, brush_set: BrushSet, underpaint: Underpaint | None
) -> dict[str, Any]:
    """Core arguments for underpaint; empty without it, and for built-in kernels.

    Raises:
        TypeError: if `underpaint` is neither None nor `Underpaint`.
        ValueError: if the boxes have no setbacks.
    """
    if underpaint is None or brush_set.kind != "image":
        return {}
    if not isinstance(underpaint, Underpaint):
        raise TypeError(
            f"{where}: underpaint must be None or Underpaint, got {type(underpaint).__name__}; "
            "Underpaint.for_sigmas makes one for boxes of any size"
        )
    if boxes.setbacks is None:
        raise ValueError(
            f"{where}: boxes must have setbacks to be underpainted; project with underpaint=True"
        )
    return {
        "setbacks": boxes.setbacks,
        "underpaint_reach": float(np.max(underpaint.reach)),
        "underpaint_reaches": underpaint.reaches(boxes),
        "underpaint_opacity": float(underpaint.opacity),
    }
