"""Error of a painting for an eye at the usual viewing distance.

Such an eye sees neither single pixels nor small differences of color: pictures are averaged over squares of
two pixels of the small views (about a blur of 2 pixels in a picture of 1000), and differences below `SEEN`
count as none. So areas without error keep large strokes, and strokes go where they are needed.
"""

from dataclasses import dataclass

import numpy as np

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.passes.color.color_space import oklab_tables
from brushgs.values.arrays import F32, F64
from brushgs.values.frame import Frame

FEWEST = 0.08  # of the requested strokes, start of an economic painting
ECONOMIC_ROUNDS = 5  # of splitting from there
SEEN = (
    0.025,
    0.075,
)  # OKLab: differences below the first do not count, above the second fully; CIEDE2000 of 2.5, 7.5
# Minimum error of a cluster that is cut, in pixels of full difference, mean over small views of 400x300. For
# 6000 strokes of a furry toy 4 saved 19 % and cost 0.2 dB; 0.35 saved none.
LEAST = 3.0


def first_share(economy: float, usual: float) -> float:
    """Share of the strokes to start with: `usual` at 0, `FEWEST` at 1, in equal ratios."""
    return float(usual ** (1 - economy) * FEWEST**economy)


@dataclass(frozen=True, eq=False)
class ViewingError:
    """The colors of a plain picture as seen from afar, the truth for painted ones.

    Attributes:
        planes: [2, 3, h, w] OKLab, over black and over white; h and w are half the size, rounded up.
    """

    planes: F32

    @classmethod
    def of(cls, plain: Frame) -> "ViewingError":
        """Build from a plain picture."""
        return cls(_seen(plain))

    def of_painted(self, painted: Frame) -> F64:
        """The squared error [H, W] of a picture of the same view, mean over black and white; 0 if not
        visible.
        """
        low, high = SEEN
        errors = np.empty(painted.alpha.shape)
        _core.seen_errors(
            plain=self.planes,
            painted=_seen(painted),
            low=low,
            high=high,
            errors=errors,
            num_threads=num_threads_or_default(None),
        )
        return errors


def _seen(frame: Frame) -> F32:
    """The planes of a picture; an odd last row or column is not averaged."""
    height, width = frame.alpha.shape
    planes = np.empty((2, 3, -(-height // 2), -(-width // 2)), np.float32)
    _core.seen_planes(
        tables=oklab_tables(),
        rgb=np.ascontiguousarray(frame.rgb, np.float32),
        alpha=np.ascontiguousarray(frame.alpha, np.float32),
        planes=planes,
        num_threads=num_threads_or_default(None),
    )
    return planes
