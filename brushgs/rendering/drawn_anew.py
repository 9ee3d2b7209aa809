"""Boxes that are drawn anew: aside, turned, of another size, with another image of their brush, or in part.

Numbers are hashes of stroke and drawing.
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

# Of a stroke that boils with strength 1; the change of a picture grows with the root of the strength, which
# therefore is the square of what is asked for.
OFFSET = 0.5  # of its width,
MOST_OFFSET = 0.02  # and of the root of the picture's area
TURN = np.radians(15.0)
SIZE = 0.25  # of the logarithm


@dataclass(frozen=True, eq=False)
class Pieces:
    """Pieces of boxes along their direction.

    Attributes:
        rows: [P] of the boxes of which a piece is painted.
        begins: [P] where the piece begins, share of the length of the box.
        ends: [P] where it ends.
    """

    rows: NDArray[np.intp]
    begins: F32
    ends: F32


def words_of(
    ids: NDArray[np.int32], keys: NDArray[np.uint32], stream: np.uint32, num: int
) -> list[NDArray[np.uint32]]:
    """[M] bits of each stroke and drawing, so many times."""
    golden = np.uint32(GOLDEN_32)
    words = [hash_32(hash_32(keys * golden + stream) + ids.astype(np.uint32) * golden)]
    while len(words) < num:
        words.append(hash_32(words[-1] + golden))
    return words


def _halves(words: NDArray[np.uint32]) -> tuple[F32, F32]:
    """Two times [M] numbers from -1 to 1 of words."""

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
    """Boxes a little aside, turned and of another size.

    Args:
        boxes: some.
        strengths: [M] by how much.
        words: two times [M] bits that decide it, see `words_of`.
        most: pixels by which they lie aside.
        rows: M of the boxes, as for `Boxes.take`.
        pieces: of those of which only a piece is painted; None for whole ones.
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
    """Boxes that are painted with another image of their brush, as many as the strength says."""
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
    """[B, V] rows of the images of the brush that each image belongs to, and [B] how many these are."""
    bases = [without_number(name) for name in names]
    rows = [[row for row, other in enumerate(bases) if other == base] for base in bases]
    counts = np.array([len(row) for row in rows])
    table = np.zeros((len(rows), counts.max()), np.uint8)
    for row, found in enumerate(rows):
        table[row, : len(found)] = found
    return table, counts
