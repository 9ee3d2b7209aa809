"""Fragments of pixels: strokes or underpaint, front to back, with blending weights.

The weight of a fragment is its share of the pixel's color; the weights of a pixel sum to alpha. Fragments
are recomputed by the rasteriser's arithmetic, a band of rows at a time, to limit memory.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.brush_set import BrushSet
from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.rendering.rasterize import RasterArguments, RasterOptions
from brushgs.values.arrays import U8, Array

if TYPE_CHECKING:
    from brushgs.rendering.depth_test import DepthTest
    from brushgs.rendering.options import RenderOptions
    from brushgs.values.boxes import Boxes
    from brushgs.values.camera import Camera

TILE_HEIGHT: int = _core.TILE_HEIGHT  # rows; fragments are computed for whole tiles


@dataclass(frozen=True, eq=False)
class Shares:
    """Coverage of pixels by key, largest first.

    Attributes:
        starts: [P + 1] int64: pixel i has the entries starts[i] to starts[i + 1] - 1.
        keys: [n] int32.
        weights: [n] coverage by each.
    """

    starts: NDArray[np.int64]  # [P + 1]
    keys: NDArray[np.int32]  # [n]
    weights: Array  # [n]


@dataclass(frozen=True, eq=False)
class Fragments:
    """F fragments of P pixels, front to back in each.

    Attributes:
        starts: [P + 1] int64: pixel i has the fragments starts[i] to starts[i + 1] - 1.
        marks: [F] int32, box of each fragment, or its row in a joint table of several sets of boxes.
        weights: [F] weight of its color in the pixel.
        shades: [F] factor of streaks on its color.
        is_underpaint: [F] uint8, 0 or 1.
    """

    starts: NDArray[np.int64]  # [P + 1]
    marks: NDArray[np.int32]  # [F]
    weights: Array  # [F]
    shades: Array  # [F]
    is_underpaint: U8  # [F]

    def __len__(self) -> int:
        return len(self.marks)

    @property
    def num_pixels(self) -> int:
        """P."""
        return len(self.starts) - 1

    def scaled(self, scales: Array) -> "Fragments":
        """Weights scaled by a factor per pixel [P]; fragments of weight 0 are dropped."""
        of_each = np.repeat(scales.astype(self.weights.dtype, copy=False), np.diff(self.starts))
        weights = self.weights * of_each
        left = np.flatnonzero(weights > 0)
        starts = np.searchsorted(left, self.starts) if len(left) < len(self) else self.starts
        return Fragments(starts, self.marks[left], weights[left], self.shades[left], self.is_underpaint[left])

    def sums(self, values: Array, num_threads: int | None = None) -> Array:
        """[P, C] sums over the fragments of each pixel of weight x value of the mark, values [marks, C]."""
        sums = np.empty((self.num_pixels, values.shape[1]), self.weights.dtype)
        _core.sum_fragments(
            **self._weighted(),
            values=np.ascontiguousarray(values, self.weights.dtype),
            sums=sums,
            num_threads=num_threads_or_default(num_threads),
        )
        return sums

    def shares(self, keys: NDArray[np.int32], least: float, num_threads: int | None = None) -> Shares:
        """Sums of weights per pixel and key ([marks] keys), largest first, ties by key.

        The last entries of a pixel are dropped while they cover less than `least` together; the first stays.
        """
        threads = num_threads_or_default(num_threads)
        return Shares(*_core.share_fragments(**self._weighted(), keys=keys, least=least, num_threads=threads))

    def _weighted(self) -> dict[str, Any]:
        return {"starts": self.starts, "marks": self.marks, "weights": self.weights}


def no_fragments(num_pixels: int, dtype: np.dtype[Any]) -> Fragments:
    """Pixels without fragments."""
    starts, none = np.zeros(num_pixels + 1, np.int64), np.empty(0, dtype)
    return Fragments(starts, np.empty(0, np.int32), none, none, np.empty(0, np.uint8))


def stacked(parts: Sequence[Fragments]) -> Fragments:
    """Stack fragments of the same pixels, the first part in front."""
    counts = [np.diff(part.starts) for part in parts]
    starts = np.concatenate([np.zeros(1, np.int64), np.cumsum(sum(counts))])
    total = int(starts[-1])
    columns: dict[str, NDArray[Any]] = {
        name: np.empty(total, getattr(parts[0], name).dtype)
        for name in ("marks", "weights", "shades", "is_underpaint")
    }
    before = starts[:-1].copy()
    for part, count in zip(parts, counts, strict=True):
        places = np.arange(len(part)) + np.repeat(before - part.starts[:-1], count)
        for name, column in columns.items():
            column[places] = getattr(part, name)
        before += count
    return Fragments(starts, **columns)


class FragmentFinder:
    """Computes the fragments of boxes as painted by `rasterize_with`, a band of rows at a time.

    Args:
        boxes: boxes of covering paint.
        camera: gives the size.
        texture: see `rasterize`.
        options: see `rasterize_with`.
        in_front_of: see `rasterize`.
        dpi: see `rasterize`.
    """

    def __init__(
        self,
        boxes: "Boxes",
        camera: "Camera",
        texture: Any,
        options: "RenderOptions",
        in_front_of: "DepthTest | None" = None,
        dpi: float | None = None,
    ) -> None:
        self._size: dict[str, Any] = {"height": camera.height, "width": camera.width}
        painted = RasterOptions(
            **self._size,
            filter=options.filter,
            depth=False,
            underpaint=options.underpaint,
            streaks=options.streaks,
            in_front_of=in_front_of,
            min_transmittance=options.min_transmittance,
            num_threads=options.num_threads,
            dpi=dpi,
        )
        self._of_core = RasterArguments(boxes, BrushSet.of(texture), painted).of_core

    def find(self, first_row: int, end_row: int) -> Fragments:
        """The fragments of the rows `first_row`, a multiple of `TILE_HEIGHT`, to `end_row` - 1."""
        arguments: dict[str, Any] = {**self._of_core, **self._size}
        return Fragments(*_core.fragments(**arguments, first_row=first_row, end_row=end_row))
