"""Boxes that are drawn anew: aside, turned, of another size, with another image of their brush, or in part.

Numbers are hashes of stroke and drawing.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.brush_set import Brushes, BrushSet
from brushgs.brushes.texture import without_number
from brushgs.rendering.options import RenderOptions
from brushgs.values.arrays import F32
from brushgs.values.boxes import Boxes
from brushgs.values.hashing import GOLDEN_32, hash_32

# Of a stroke that boils with strength 1; the change of a picture grows with the root of the strength, which
# therefore is the square of what is asked for.
OFFSET = 0.5  # of its width,
MOST_OFFSET = 0.02  # and of the root of the picture's area
TURN = np.radians(15.0)
SIZE = 0.25  # of the logarithm


def words_of(ids: NDArray[np.int32], keys: NDArray[np.uint32], stream: np.uint32) -> NDArray[np.uint32]:
    """[M, 3] bits of each stroke and drawing."""
    golden = np.uint32(GOLDEN_32)
    first = hash_32(hash_32(keys * golden + stream) + ids.astype(np.uint32) * golden)
    second = hash_32(first + golden)
    return np.stack([first, second, hash_32(second + golden)], axis=1)


def _halves(words: NDArray[np.uint32]) -> F32:
    """[..., 2] numbers from -1 to 1 of words."""
    halves = np.stack([words & np.uint32(0xFFFF), words >> np.uint32(16)], axis=-1)
    numbers: F32 = halves.astype(np.float32)
    numbers *= np.float32(2 / 65535)
    numbers -= np.float32(1)
    return numbers


def aside(boxes: Boxes, strengths: F32, words: NDArray[np.uint32], most: float) -> Boxes:
    """Boxes a little aside, at most so many pixels, turned and of another size."""
    dtype, half = boxes.centers.dtype, boxes.half_extents
    numbers = _halves(words[:, :2])  # [M, 2, 2]
    reach = (strengths * np.minimum(np.float32(2 * OFFSET) * half.min(axis=1), np.float32(most)))[:, None]
    turns = np.float32(TURN) * strengths * numbers[:, 1, 0]
    sizes = np.exp(np.float32(SIZE) * strengths * numbers[:, 1, 1])[:, None]
    return replace(
        boxes,
        centers=(boxes.centers + reach * numbers[:, 0]).astype(dtype, copy=False),
        half_extents=(half * sizes).astype(dtype, copy=False),
        angles=(boxes.angles + turns).astype(dtype, copy=False),
    )


def in_other_images(
    boxes: Boxes, strengths: F32, words: NDArray[np.uint32], texture: Brushes, options: RenderOptions
) -> Boxes:
    """Boxes that are painted with another image of their brush, as many as the strength says."""
    siblings, counts = _siblings(BrushSet.of(texture).names)
    if boxes.brushes is None or counts.max() == 1:
        return boxes
    numbers = 0.5 * _halves(words[:, 2]) + 0.5
    places = (numbers[:, 1] * counts[boxes.brushes]).astype(np.intp)
    others = siblings[boxes.brushes, np.minimum(places, counts[boxes.brushes] - 1)]
    brushes = np.where(numbers[:, 0] < strengths, others, boxes.brushes)
    half, sigmas = boxes.half_extents, options.num_sigmas
    if isinstance(sigmas, tuple):
        of_brush = np.array(sigmas, half.dtype)
        half = half * (of_brush[brushes] / of_brush[boxes.brushes])[:, None]
    return replace(boxes, brushes=brushes, half_extents=half)


def _siblings(names: Sequence[str]) -> tuple[NDArray[np.uint8], NDArray[np.intp]]:
    """[B, V] rows of the images of the brush that each image belongs to, and [B] how many these are."""
    bases = [without_number(name) for name in names]
    rows = [[row for row, other in enumerate(bases) if other == base] for base in bases]
    counts = np.array([len(row) for row in rows])
    table = np.zeros((len(rows), counts.max()), np.uint8)
    for row, found in enumerate(rows):
        table[row, : len(found)] = found
    return table, counts


def between(boxes: Boxes, begins: Any, ends: Any) -> Boxes:
    """The boxes from one place along their directions to another, shares of their lengths."""
    half, dtype = boxes.half_extents, boxes.centers.dtype
    along = np.stack([np.cos(boxes.angles), np.sin(boxes.angles)], axis=1)
    shift = ((begins + ends - 1) * half[:, 0])[:, None]
    lengths = (ends - begins) * half[:, 0]
    return replace(
        boxes,
        centers=(boxes.centers + shift * along).astype(dtype, copy=False),
        half_extents=np.stack([lengths, half[:, 1]], axis=1).astype(dtype, copy=False),
    )
