"""Marks of a view: all boxes of covering paint, of all coats, in one table; and their fragments.

Fragments of a later coat lie in front of earlier ones, whatever their depth, and attenuate them. Weights of
dry marks are scaled by the share that the paper takes. Glazes have no fragments: they tint the layers below.
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

MOST_FRAGMENTS = 4_000_000  # approximate number in memory at a time, 13 bytes each in float32
FIRST_ROWS = 4 * TILE_HEIGHT  # rows of the first band, to estimate the density of fragments


@dataclass(frozen=True, eq=False)
class LaidCoat:
    """A coat as laid in one view.

    Attributes:
        coat: the coat.
        boxes: its boxes.
        in_front_of: their depth test.
        alpha: [H, W] its own coverage.
        share: [H, W] share of its paint that the paper takes; None for all.
        tint: [H, W, 3] of a glaze; None for covering paint.
        picture: [H, W, 3] its colors if an effect gives them, not premultiplied; None for those of boxes.
        dpi: see `rasterize`.
    """

    coat: "Coat"
    boxes: Boxes
    in_front_of: "DepthTest | None"
    alpha: Array  # [H, W]
    share: Array | None = None  # [H, W]
    tint: Array | None = None  # [H, W, 3]
    picture: Array | None = None  # [H, W, 3]
    dpi: float | None = None

    @classmethod
    def of(
        cls,
        coat: "Coat",
        boxes: Boxes,
        painted: Frame,
        taken: Frame,
        in_front_of: "DepthTest | None" = None,
        dpi: float | None = None,
    ) -> "LaidCoat":
        """From its own frame, and the part of it that the paper takes."""
        share = None
        if taken is not painted and coat.blend == "cover":
            share = np.divide(
                taken.alpha, painted.alpha, out=np.zeros_like(taken.alpha), where=painted.alpha > 0
            )
        tint = taken.rgb.copy() if coat.blend == "glaze" else None  # the canvas reuses these arrays
        picture = None
        if coat.effect is not None and coat.blend == "cover":
            alpha = taken.alpha[..., None]
            picture = np.divide(taken.rgb, alpha, out=np.zeros_like(taken.rgb), where=alpha > 0)
        return cls(coat, boxes, in_front_of, taken.alpha.copy(), share, tint, picture, dpi)

    @property
    def num_rows(self) -> int:
        """Number of strokes plus plain Gaussians."""
        return len(self.coat.strokes) + (0 if self.coat.plain is None else len(self.coat.plain))

    @property
    def is_plain(self) -> Mask:
        """[M] mask of boxes of plain Gaussians."""
        return np.asarray(self.boxes.ids >= len(self.coat.strokes))

    def column(self, name: str) -> NDArray[Any]:
        """[num_rows, ...] a column of its strokes and plain Gaussians."""
        parts: list[Gaussians] = [self.coat.strokes]
        if self.coat.plain is not None:
            parts.append(self.coat.plain)
        columns = [getattr(part, name) for part in parts]
        return columns[0] if len(columns) == 1 else np.concatenate(columns)


class Marks:
    """All boxes of covering paint, in the order of coats.

    Args:
        laid: all coats, in the order of laying.
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
        """Number of threads of the coats' options."""
        return self.all_laid[0].coat.options.num_threads if self.all_laid else None

    @property
    def numbers(self) -> NDArray[np.int64]:
        """[marks] number of the stroke among those of all coats, including glazes."""
        return self.each(lambda i, laid: laid.boxes.ids + self.first_numbers[self.covering[i]], np.int64)

    @property
    def coats(self) -> Rows:
        """[marks] index of the coat in `laid`."""
        return np.repeat(np.arange(len(self.laid)), np.diff(self.firsts))

    def each(self, column_of: Any, dtype: Any, *shape: int) -> NDArray[Any]:
        """[marks, ...] joined results of `column_of(index, laid coat)` over the covering coats."""
        columns = [np.asarray(column_of(i, laid), dtype) for i, laid in enumerate(self.laid)]
        return np.concatenate(columns) if columns else np.empty((0, *shape), dtype)

    def bands(self) -> Iterator[tuple[slice, Fragments]]:
        """The fragments of the picture in bands: rows, and their fragments.

        Results do not depend on the size of the bands.
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
            FragmentFinder(
                each.boxes, self.camera, each.coat.texture, each.coat.options, each.in_front_of, each.dpi
            )
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
