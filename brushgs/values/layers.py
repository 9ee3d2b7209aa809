"""Layers for compositing: mattes, and the strokes of each pixel."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import F32, U32, Array, check
from brushgs.values.part import Part


@dataclass(frozen=True, eq=False)
class Matte:
    """Coverage of each pixel by each of several items, as in a Cryptomatte.

    Attributes:
        names: of the items.
        rows: [H, W, K] int32, index into `names`, largest coverage first; -1 for unused entries.
        coverage: [H, W, K] float32, 0 to 1: weight of the item in the picture. The sum over K is the alpha of
            covering paint, to less than half of 1/255; glazes only tint and have no coverage. In the matte of
            layers the ground, or without one the glazes, take the rest of the picture's alpha.

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
    """All visible strokes of each pixel, nearest first.

    Composited in this order they give the picture: under soft order, alphas are chosen to give the strokes
    their blended weights.

    Attributes:
        starts: [H * W + 1] int64: pixel i, row by row, has the samples starts[i] to starts[i + 1] - 1.
        colors: [S, 3] RGB premultiplied by alpha, display-encoded.
        alphas: [S] 0 to 1.
        depths: [S] camera z, world units, ascending within a pixel.
        ids: [S] uint32, 1 + row of the stroke in the painting; 0 if not a stroke.
        height: image height, pixels.
        width: image width, pixels.
    """

    starts: NDArray[np.int64]  # [H * W + 1]
    colors: F32  # [S, 3]
    alphas: F32  # [S]
    depths: F32  # [S]
    ids: U32  # [S]
    height: int
    width: int

    def cut(self, part: Part) -> "DeepSamples":
        """The samples of a part of the picture."""
        pixels = np.arange(self.height * self.width).reshape(self.height, self.width)
        chosen = pixels[part.rows, part.columns].ravel()
        firsts, counts = self.starts[chosen], self.starts[chosen + 1] - self.starts[chosen]
        starts = np.concatenate([[0], np.cumsum(counts)])
        of_samples = np.repeat(firsts - starts[:-1], counts) + np.arange(starts[-1])
        columns = (self.colors, self.alphas, self.depths, self.ids)
        colors, alphas, depths, ids = (column[of_samples] for column in columns)
        return DeepSamples(starts, colors, alphas, depths, ids, part.height, part.width)


Layer = Array | Matte  # one of `Frame.layers`
