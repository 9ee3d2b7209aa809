"""Draw boxes anew: shifted, turned, resized, with another image of their brush, or in part.

Random numbers are hashes of stroke and drawing.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.brush_set import Brushes, BrushSet
from brushgs.brushes.texture import without_number
from brushgs.rendering.options import RenderOptions
from brushgs.values.arrays import F32
from brushgs.values.boxes import Boxes
from brushgs.values.columns import RowChoice
from brushgs.values.hashing import GOLDEN_32, hash_32

# Largest changes at strength 1. The change of a picture grows with the root of the strength, which is
# therefore the square of the option.
OFFSET = 0.5  # shift over the width of the stroke
MOST_OFFSET = 0.02  # limit of the shift over the root of the picture's area
TURN = np.radians(15.0)
SIZE = 0.25  # of the logarithm of the size


@dataclass(frozen=True, eq=False)
class Pieces:
    """Pieces of boxes along their direction.

    Attributes:
        rows: [P] rows of the boxes.
        begins: [P] start of the piece, share of the length of the box.
        ends: [P] end of the piece, likewise.
    """

    rows: NDArray[np.intp]
    begins: F32
    ends: F32


def words_of(
    ids: NDArray[np.int32], keys: NDArray[np.uint32], stream: np.uint32, num: int
) -> list[NDArray[np.uint32]]:
    """`num` arrays [M] of random bits for each stroke and drawing."""
    golden = np.uint32(GOLDEN_32)
    words = [hash_32(hash_32(keys * golden + stream) + ids.astype(np.uint32) * golden)]
    while len(words) < num:
        words.append(hash_32(words[-1] + golden))
    return words


def _halves(words: NDArray[np.uint32]) -> tuple[F32, F32]:
    """Two arrays [M] of numbers from -1 to 1, from the halves of words."""

    def number(half: NDArray[np.uint32]) -> F32:
        return np.asarray(half.astype(np.float32) * np.float32(2 / 65535) - np.float32(1))

    return number(words & np.uint32(0xFFFF)), number(words >> np.uint32(16))


def aside(
    boxes: Boxes,
    strengths: F32,
    words: Sequence[NDArray[np.uint32]],
    most: float,
    rows: RowChoice = slice(None),
    pieces: Pieces | None = None,
) -> Boxes:
    """Shift, turn and resize boxes randomly.

    Args:
        boxes: the boxes.
        strengths: [M] strength of the change.
        words: two arrays [M] of random bits, see `words_of`.
        most: limit of the shift, pixels.
        rows: M rows of the boxes, as for `Boxes.take`.
        pieces: for boxes of which only a piece is painted; None if there are none.
    """
    columns = boxes.columns_of(rows)
    dtype, half = boxes.centers.dtype, columns["half_extents"]
    (x, y), (turn, size) = _halves(words[0]), _halves(words[1])
    reach = strengths * np.minimum(
        np.float32(2 * OFFSET) * np.minimum(half[:, 0], half[:, 1]), np.float32(most)
    )
    centers = columns["centers"] + np.stack([reach * x, reach * y], axis=1)
    angles = columns["angles"] + np.float32(TURN) * strengths * turn
    half = half * np.exp(np.float32(SIZE) * strengths * size)[:, None]
    if pieces is not None:
        shift = (pieces.begins + pieces.ends - 1) * half[pieces.rows, 0]
        angle = angles[pieces.rows]
        centers[pieces.rows] += np.stack([shift * np.cos(angle), shift * np.sin(angle)], axis=1)
        half[pieces.rows, 0] *= pieces.ends - pieces.begins
    moved = {"centers": centers, "half_extents": half, "angles": angles}
    return Boxes(**columns | {name: column.astype(dtype, copy=False) for name, column in moved.items()})


def in_other_images(
    boxes: Boxes,
    strengths: F32,
    words: Sequence[NDArray[np.uint32]],
    texture: Brushes,
    options: RenderOptions,
) -> Boxes:
    """Choose another image of the same brush for a random share of the boxes, given by the strength."""
    siblings, counts = _siblings(BrushSet.of(texture).names)
    if boxes.brushes is None or counts.max() == 1:
        return boxes
    chance, place = (0.5 * number + 0.5 for number in _halves(words[2]))
    places = (place * counts[boxes.brushes]).astype(np.intp)
    others = siblings[boxes.brushes, np.minimum(places, counts[boxes.brushes] - 1)]
    brushes = np.where(chance < strengths, others, boxes.brushes)
    half, sigmas = boxes.half_extents, options.num_sigmas
    if isinstance(sigmas, tuple):
        of_brush = np.array(sigmas, half.dtype)
        half = half * (of_brush[brushes] / of_brush[boxes.brushes])[:, None]
    return replace(boxes, brushes=brushes, half_extents=half)


def _siblings(names: Sequence[str]) -> tuple[NDArray[np.uint8], NDArray[np.intp]]:
    """For each image, [B, V] rows of all images of its brush, and [B] their number."""
    bases = [without_number(name) for name in names]
    rows = [[row for row, other in enumerate(bases) if other == base] for base in bases]
    counts = np.array([len(row) for row in rows])
    table = np.zeros((len(rows), counts.max()), np.uint8)
    for row, found in enumerate(rows):
        table[row, : len(found)] = found
    return table, counts
