"""The marks of a view: all boxes of paint that covers, of all coats, in one table; and the pixels they make.

A coat covers what was laid before it, wherever it lies: its fragments stand in front, and what is below
counts as much as it lets through. Dry marks count as much as the paper takes of them. Glazes have no
fragments: they tint what is below them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from brushgs.rendering.fragments import (
    TILE_HEIGHT,
    FragmentFinder,
    Fragments,
    no_fragments,
    stacked,
)
from brushgs.values.arrays import Array, Mask, Rows
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.rendering.coat import Coat
    from brushgs.rendering.depth_test import DepthTest

MOST_FRAGMENTS = 4_000_000  # about so many are in memory at a time, 13 bytes each in float32
FIRST_ROWS = 4 * TILE_HEIGHT  # rows at first, from which it is seen how many make so many fragments


@dataclass(frozen=True, eq=False)
class LaidCoat:
    """A coat as it was laid in one view.

    Attributes:
        coat: the coat.
        boxes: its boxes.
        in_front_of: the depth test they passed.
        alpha: [H, W] what it covers alone.
        share: [H, W] share of its paint that the paper takes; None for all.
        tint: [H, W, 3] of a glaze; None for paint that covers.
    """

    coat: "Coat"
    boxes: Boxes
    in_front_of: "DepthTest | None"
    alpha: Array  # [H, W]
    share: Array | None = None  # [H, W]
    tint: Array | None = None  # [H, W, 3]

    @classmethod
    def of(
        cls, coat: "Coat", boxes: Boxes, painted: Frame, taken: Frame, in_front_of: "DepthTest | None" = None
    ) -> "LaidCoat":
        """From what it alone has painted, and what the paper takes of that."""
        share = None
        if taken is not painted and coat.blend == "cover":
            share = np.divide(
                taken.alpha, painted.alpha, out=np.zeros_like(taken.alpha), where=painted.alpha > 0
            )
        tint = taken.rgb.copy() if coat.blend == "glaze" else None  # the canvas goes on with these arrays
        return cls(coat, boxes, in_front_of, taken.alpha.copy(), share, tint)

    @property
    def num_rows(self) -> int:
        """How many strokes it has, and Gaussians that are shown as they are."""
        return len(self.coat.strokes) + (0 if self.coat.plain is None else len(self.coat.plain))

    @property
    def is_plain(self) -> Mask:
        """[M] the boxes of Gaussians that are shown as they are."""
        return np.asarray(self.boxes.ids >= len(self.coat.strokes))

    def column(self, name: str) -> NDArray[Any]:
        """[num_rows, ...] a column of its strokes, and of what is shown as it is."""
        parts: list[Gaussians] = [self.coat.strokes]
        if self.coat.plain is not None:
            parts.append(self.coat.plain)
        columns = [getattr(part, name) for part in parts]
        return columns[0] if len(columns) == 1 else np.concatenate(columns)


class Marks:
    """All boxes that cover, those of the coat laid first first.

    Args:
        laid: all coats, the first laid first.
        camera: the view.
        dtype: of the frame.
    """

    def __init__(self, laid: Sequence[LaidCoat], camera: Camera, dtype: np.dtype[Any]) -> None:
        self.camera, self.dtype, self.all_laid = camera, dtype, tuple(laid)
        self.covering = [i for i, each in enumerate(laid) if each.tint is None]
        self.laid = [laid[i] for i in self.covering]
        self.firsts = np.cumsum([0, *(len(each.boxes) for each in self.laid)])
        self.first_numbers = np.cumsum([0, *(each.num_rows for each in laid)])

    def __len__(self) -> int:
        return int(self.firsts[-1])

    @property
    def num_threads(self) -> int | None:
        """As the coats are painted."""
        return self.all_laid[0].coat.options.num_threads if self.all_laid else None

    @property
    def numbers(self) -> NDArray[np.int64]:
        """[marks] of each the number of its stroke among those of all coats, glazes included."""
        return self.each(lambda i, laid: laid.boxes.ids + self.first_numbers[self.covering[i]], np.int64)

    @property
    def coats(self) -> Rows:
        """[marks] the place of its coat in `laid`."""
        return np.repeat(np.arange(len(self.laid)), np.diff(self.firsts))

    def each(self, column_of: Any, dtype: Any, *shape: int) -> NDArray[Any]:
        """[marks, ...] what `column_of(place, laid coat)` gives for the boxes of each coat that covers."""
        columns = [np.asarray(column_of(i, laid), dtype) for i, laid in enumerate(self.laid)]
        return np.concatenate(columns) if columns else np.empty((0, *shape), dtype)

    def bands(self) -> Iterator[tuple[slice, Fragments]]:
        """The fragments of the picture, by rows of pixels: rows, and what they are made of.

        What is made of them does not depend on how many rows come at a time.
        """
        height, finders = self.camera.height, self._finders()
        first, rows, found = 0, FIRST_ROWS, 0
        while first < height:
            end = min(first + rows, height)
            fragments = self._fragments(finders, first, end)
            yield slice(first, end), fragments
            found += len(fragments)
            first, most = end, MOST_FRAGMENTS * end // max(found, 1)
            rows = max(most // TILE_HEIGHT, 1) * TILE_HEIGHT

    def _finders(self) -> list[FragmentFinder]:
        return [
            FragmentFinder(each.boxes, self.camera, each.coat.texture, each.coat.options, each.in_front_of)
            for each in self.laid
        ]

    def _fragments(self, finders: list[FragmentFinder], first: int, end: int) -> Fragments:
        parts, passed = [], None
        for i in reversed(range(len(finders))):
            part, laid = finders[i].find(first, end), self.laid[i]
            part.marks[...] += np.int32(self.firsts[i])
            scales = passed
            if laid.share is not None:
                share = laid.share[first:end].ravel()
                scales = share if scales is None else scales * share
            parts.append(part if scales is None else part.scaled(scales))
            light = 1 - laid.alpha[first:end].ravel()
            passed = light if passed is None else passed * light
        if not parts:
            return no_fragments((end - first) * self.camera.width, self.dtype)
        return parts[0] if len(parts) == 1 else stacked(parts)
