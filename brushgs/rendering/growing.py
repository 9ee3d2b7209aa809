"""A painting that comes into being: each stroke has a time at which it comes, and some are painted over.

Time runs from 0, the bare ground, to 1, the finished painting. Times belong to the strokes, so a frame of a
growing painting is a frame like any other, of strokes with other opacities: depth, brushes, relief and light
are those of the finished one.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.values.arrays import F64


@dataclass(frozen=True, eq=False)
class GrowingCoat:
    """A coat whose strokes come one after the other.

    Attributes:
        coat: the strokes of the finished coat, then those that they are painted over.
        comes: [N] when each begins to come, 0 to 1; infinite for one that is never seen.
        leaves: [N] when what it gives way to begins to come; infinite for the strokes of the finished coat.
        laid: [N] how many strokes of the painting were laid before it, as a share of all.
    """

    coat: Coat
    comes: F64
    leaves: F64
    laid: F64

    def at(self, time: float, fade: float) -> Coat | None:
        """The coat at a time, in which strokes come within `fade`; None where it is not begun."""
        begins = (1 - 2 * fade) * self.comes
        shares = np.clip((time - begins) / fade, 0, 1)
        leaving = np.isfinite(self.leaves)
        ends = (1 - 2 * fade) * self.leaves[leaving] + fade  # what it gives way to has come
        shares[leaving] *= np.clip((ends - time) / fade + 1, 0, 1)
        return self._shown(shares)

    def first(self, share: float) -> Coat | None:
        """The coat when a share of all strokes is laid; None where it is not begun."""
        is_there = (self.laid < share) & np.isfinite(self.comes)
        time = self.comes[is_there].max(initial=-1)
        return self._shown(is_there & ~(self.leaves <= time))

    def _shown(self, shares: F64) -> Coat | None:
        if not shares.any() and self.coat.plain is None:
            return None
        strokes = self.coat.strokes
        # Rows stay, though some are invisible: the streaks of a stroke go by its row.
        opacities = (strokes.opacities * shares).astype(strokes.opacities.dtype)
        return replace(self.coat, strokes=replace(strokes, opacities=opacities))


@dataclass(frozen=True, eq=False)
class GrowingPainting:
    """A painting, and how it comes into being.

    Attributes:
        finished: the painting.
        coats: its coats, with the times of their strokes.
    """

    finished: Painting
    coats: tuple[GrowingCoat, ...]

    def at(self, time: float, fade: float) -> Painting:
        """The painting at a time from 0 to 1; at 1 the finished one itself.

        Args:
            time: of the painting.
            fade: the time within which a stroke comes, above 0 to 1/2; what it replaces leaves in as much
                after that.
        """
        if time >= 1:
            return self.finished
        return self._of(coat.at(time, fade) for coat in self.coats)

    def first(self, share: float) -> Painting:
        """The painting when a share of its strokes is laid, 0 to 1; at 1 the finished one itself."""
        if share >= 1:
            return self.finished
        return self._of(coat.first(share) for coat in self.coats)

    def _of(self, coats: Iterable[Coat | None]) -> Painting:
        return replace(self.finished, coats=tuple(coat for coat in coats if coat is not None))
