"""What a picture is made of, for compositing: mattes, and the strokes in each pixel."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import F32, Array, check


@dataclass(frozen=True, eq=False)
class Matte:
    """How much of each pixel each of several things covers: what a Cryptomatte holds.

    Attributes:
        names: of the things.
        rows: [H, W, K] int32, of `names`: what covers most of the pixel first; -1 where nothing more is.
        coverage: [H, W, K] float32, how much of the pixel each covers, 0 to 1: its weight in the picture.
            The sum over K is the alpha of paint that covers, to less than half of 1/255; glazes only tint
            what lies below them. In the matte of layers the ground, or without one the glazes, take what is
            left of the alpha of the picture.

    Raises:
        ValueError: if the shapes differ.
    """

    names: tuple[str, ...]
    rows: NDArray[np.int32]  # [H, W, K]
    coverage: F32  # [H, W, K]

    def __post_init__(self) -> None:
        check("Matte", rows=(self.rows, "H W K"), coverage=(self.coverage, "H W K"))


@dataclass(frozen=True, eq=False)
class DeepSamples:
    """Every stroke that a picture shows in every pixel, the nearest first.

    Laid over each other in this order they are the picture: strokes that fade into each other (soft order)
    have the alphas that give the weights they have there.

    Attributes:
        starts: [H * W + 1] int64: pixel i, row by row, has the samples starts[i] to starts[i + 1] - 1.
        colors: [S, 3] RGB premultiplied by alpha, display-encoded.
        alphas: [S] 0 to 1.
        depths: [S] camera z, world units, ascending within a pixel.
        ids: [S] uint32, 1 + the number of the stroke among those of the painting; 0 for what is no stroke.
        height: of the picture, pixels.
        width: of the picture, pixels.
    """

    starts: NDArray[np.int64]  # [H * W + 1]
    colors: F32  # [S, 3]
    alphas: F32  # [S]
    depths: F32  # [S]
    ids: NDArray[np.uint32]  # [S]
    height: int
    width: int


Layer = Array | Matte  # one of `Frame.layers`
