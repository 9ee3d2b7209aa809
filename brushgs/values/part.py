"""A part of a picture: a rectangle of its pixels."""

from dataclasses import dataclass
from typing import Self

TILE = 32, 16  # width and height of the tiles of the rasteriser, pixels; see core/include/brushgs/raster.hpp


@dataclass(frozen=True)
class Part:
    """A rectangle of pixels of a picture.

    Attributes:
        left: its first column, >= 0.
        top: its first row, >= 0.
        width: pixels, >= 1.
        height: pixels, >= 1.
    """

    left: int
    top: int
    width: int
    height: int

    @classmethod
    def whole(cls, width: int, height: int) -> Self:
        """The whole picture."""
        return cls(0, 0, width, height)

    @property
    def rows(self) -> slice:
        """Slice of its rows."""
        return slice(self.top, self.top + self.height)

    @property
    def columns(self) -> slice:
        """Slice of its columns."""
        return slice(self.left, self.left + self.width)

    def is_in(self, width: int, height: int) -> bool:
        """Whether it lies entirely in a picture of this size."""
        return self.left + self.width <= width and self.top + self.height <= height

    def grown(self, reach: int, width: int, height: int) -> "Part":
        """The part extended by `reach` pixels, then to whole tiles, within a picture of this size."""
        spans = (self.columns, TILE[0], width), (self.rows, TILE[1], height)
        (left, right), (top, bottom) = (
            (
                max(span.start - reach, 0) // tile * tile,
                min(-(-(span.stop + reach) // tile) * tile, size),
            )
            for span, tile, size in spans
        )
        return Part(left, top, right - left, bottom - top)

    def inside(self, other: "Part") -> "Part":
        """The same pixels relative to the corner of another part that contains them."""
        return Part(self.left - other.left, self.top - other.top, self.width, self.height)
