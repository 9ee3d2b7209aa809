"""Growing paintings: each stroke has a time of appearance, and some strokes are later painted over.

Time runs from 0 (bare ground) to 1 (finished painting). A frame of a growing painting is an ordinary frame
with other stroke opacities; depth, brushes, relief and light are those of the finished painting.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.values.arrays import F64


@dataclass(frozen=True, eq=False)
class GrowingCoat:
    """A coat whose strokes appear one after the other.

    Attributes:
        coat: the strokes of the finished coat, then the earlier ones that they paint over.
        comes: [N] time at which each starts to appear, 0 to 1; infinite if never.
        leaves: [N] time at which its replacement starts to appear; infinite for strokes of the finished coat.
        laid: [N] share of the painting's strokes laid before it.
    """

    coat: Coat
    comes: F64
    leaves: F64
    laid: F64

    def at(self, time: float, fade: float) -> Coat | None:
        """The coat at a time; strokes fade in over `fade`. None before its first stroke."""
        begins = (1 - 2 * fade) * self.comes
        shares = np.clip((time - begins) / fade, 0, 1)
        leaving = np.isfinite(self.leaves)
        ends = (1 - 2 * fade) * self.leaves[leaving] + fade  # its replacement is complete
        shares[leaving] *= np.clip((ends - time) / fade + 1, 0, 1)
        return self._shown(shares)

    def first(self, share: float) -> Coat | None:
        """The coat with the first share of all strokes laid; None before its first stroke."""
        is_there = (self.laid < share) & np.isfinite(self.comes)
        time = self.comes[is_there].max(initial=-1)
        return self._shown(is_there & ~(self.leaves <= time))

    def _shown(self, shares: F64) -> Coat | None:
        if not shares.any() and self.coat.plain is None:
            return None
        strokes = self.coat.strokes
        # Invisible rows stay: streaks depend on the row of a stroke.
        opacities = (strokes.opacities * shares).astype(strokes.opacities.dtype)
        return replace(self.coat, strokes=replace(strokes, opacities=opacities))


@dataclass(frozen=True, eq=False)
class GrowingPainting:
    """A painting with the times of its strokes.

    Attributes:
        finished: the finished painting.
        coats: its coats, with the times of their strokes.
    """

    finished: Painting
    coats: tuple[GrowingCoat, ...]

    def at(self, time: float, fade: float) -> Painting:
        """The painting at a time from 0 to 1; at 1 the finished one itself.

        Args:
            time: of the painting.
            fade: fade-in time of a stroke, in (0, 1/2]; a stroke that it replaces fades out in the same time
                after that.
        """
        if time >= 1:
            return self.finished
        return self._of(coat.at(time, fade) for coat in self.coats)

    def first(self, share: float) -> Painting:
        """The painting with the first share of its strokes laid, 0 to 1; at 1 the finished one itself."""
        if share >= 1:
            return self.finished
        return self._of(coat.first(share) for coat in self.coats)

    def _of(self, coats: Iterable[Coat | None]) -> Painting:
        return replace(self.finished, coats=tuple(coat for coat in coats if coat is not None))
