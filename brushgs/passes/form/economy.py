"""Error of a painting for an eye at the usual viewing distance.

Such an eye sees neither single pixels nor small differences of colour: pictures are averaged over squares of
two pixels of the small views (about a blur of 2 pixels in a picture of 1000), and differences below `SEEN`
count as none. So areas without error keep large strokes, and strokes go where they are needed.
"""

from dataclasses import dataclass

import numpy as np

from brushgs.passes.color.color_space import oklab_planes
from brushgs.values.arrays import F32, F64, Array, smoothstep
from brushgs.values.frame import Frame

FEWEST = 0.08  # of the requested strokes, start of an economic painting
ECONOMIC_ROUNDS = 5  # of splitting from there
SEEN = (
    0.025,
    0.075,
)  # OKLab: differences below which none counts, and above which all count; CIEDE2000 of 2.5, 7.5
# Minimum error of a cluster that is cut, in pixels of full difference, mean over small views of 400x300. For
# 6000 strokes of a furry toy 4 saved 19 % and cost 0.2 dB; 0.35 saved none.
LEAST = 3.0


def first_share(economy: float, usual: float) -> float:
    """Share of the strokes to start with: `usual` at 0, `FEWEST` at 1, in equal ratios."""
    return float(usual ** (1 - economy) * FEWEST**economy)


@dataclass(frozen=True, eq=False)
class ViewingError:
    """The colours of a plain picture as seen from afar, the truth for painted ones.

    Attributes:
        planes: two of [3, h, w] OKLab, over black and over white.
    """

    planes: tuple[F32, F32]

    @classmethod
    def of(cls, plain: Frame) -> "ViewingError":
        """Build from a plain picture."""
        return cls(_seen(plain))

    def of_painted(self, painted: Frame) -> F64:
        """The squared error [H, W] of a picture of the same view, mean over black and white; 0 if not
        visible.
        """
        height, width = painted.alpha.shape
        total = np.zeros(self.planes[0].shape[1:])
        for plain, other in zip(self.planes, _seen(painted), strict=True):
            away = other - plain
            squares = np.einsum("chw,chw->hw", away, away)
            low, high = SEEN
            total += 0.5 * squares * smoothstep((np.sqrt(squares) - low) / (high - low))
        return total.repeat(2, axis=0).repeat(2, axis=1)[:height, :width]


def _seen(frame: Frame) -> tuple[F32, F32]:
    rgb, alpha = _halved(frame.rgb), _halved(frame.alpha[..., None])
    over_white = rgb + (1 - alpha)
    return oklab_planes(rgb), oklab_planes(over_white)


def _halved(picture: Array) -> F32:
    """[ceil(H / 2), ceil(W / 2), C] means of squares of 2 x 2 pixels; an odd last row or column is not
    averaged.
    """
    height, width = picture.shape[:2]
    if height % 2 or width % 2:
        picture = np.pad(picture, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
    rows = picture[::2] + picture[1::2]
    return np.asarray(0.25 * (rows[:, ::2] + rows[:, 1::2]), np.float32)
