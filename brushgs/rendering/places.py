"""Position of a pixel's paint on its stroke, and its motion to the next frame.

The stroke with the largest weight represents the pixel. Paint at (s, t) of its box is at the same (s, t) of
its box in the next frame.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.brush_set import BrushSet
from brushgs.rendering.fragments import Fragments
from brushgs.rendering.marks import LaidCoat, Marks
from brushgs.values.arrays import F64, Mask, Rows
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera

if TYPE_CHECKING:
    from brushgs.rendering.coat import Coat
    from brushgs.rendering.wanted import Following

TINY = np.finfo(np.float64).tiny  # replaces half extents of zero
ALL_OF_IT = 3.0e38  # larger than any coverage, so that only the first stroke is kept


def dominant_marks(fragments: Fragments, num_marks: int, num_threads: int | None) -> NDArray[np.int64]:
    """[P] mark with the largest weight in each pixel, including underpaint; -1 if none."""
    own = np.arange(num_marks, dtype=np.int32)
    shares = fragments.shares(own, ALL_OF_IT, num_threads)
    marks = np.full(fragments.num_pixels, -1, np.int64)
    marks[np.diff(shares.starts) > 0] = shares.keys
    return marks


class PixelMaps:
    """Affine maps of each mark from picture coordinates, pixels, to two numbers.

    Args:
        maps: [marks, 2, 3] of (x, y, 1).
    """

    def __init__(self, maps: F64) -> None:
        self._maps = maps.reshape(-1, 6)

    def at(self, marks: NDArray[np.int64], rows: slice, width: int) -> F64:
        """[P, 2] values at the pixel centers of these rows, by the mark of each; 0 for mark -1."""
        values = np.zeros((len(marks), 2))
        pixels = np.flatnonzero(marks >= 0)
        y, x = np.divmod(pixels, width)
        m = self._maps[marks[pixels]]
        x_centers, y_centers = x + 0.5, y + (rows.start + 0.5)
        values[pixels, 0] = m[:, 0] * x_centers + m[:, 1] * y_centers + m[:, 2]
        values[pixels, 1] = m[:, 3] * x_centers + m[:, 4] * y_centers + m[:, 5]
        return values


def uv_maps(marks: Marks) -> F64:
    """[marks, 2, 3] maps from the picture to box coordinates, 0 to 1 along u and v."""
    maps = 0.5 * marks.each(lambda _, laid: maps_to(laid.boxes), np.float64, 2, 3)
    maps[:, :, 2] += 0.5
    return np.asarray(maps)


def motion_maps(marks: Marks, following: "Following") -> F64:
    """[marks, 2, 3] maps from the picture to the motion to the next frame, pixels right and down."""
    places = {coat.name: i for i, coat in enumerate(following.coats)}

    def of_coat(_: int, laid: LaidCoat) -> F64:
        coat, i = laid.coat, places.get(laid.coat.name)
        if i is None:  # the coat is absent in the next frame: its paint moves with the camera only
            centers = projected(coat, laid.boxes.ids, following.camera)
            return _shifts(centers - laid.boxes.centers)
        directions = following.directions[i] if i < len(following.directions) else None
        coat = following.coats[i]
        return _motion_of(laid, coat, coat.boxes(following.camera, directions)[0], following.camera)

    maps = marks.each(of_coat, np.float64, 2, 3)
    return np.asarray(following.sign * maps)


def _motion_of(laid: LaidCoat, coat: "Coat", boxes: Boxes, camera: Camera) -> F64:
    """[M, 2, 3] motion maps of one coat; `boxes` are those of the next frame."""
    row_of = np.full(laid.num_rows, -1)
    row_of[boxes.ids] = np.arange(len(boxes))
    rows = row_of[laid.boxes.ids]
    is_there = rows >= 0
    maps = np.empty((len(rows), 2, 3))
    gone = laid.boxes.ids[~is_there]
    maps[~is_there] = _shifts(projected(coat, gone, camera) - laid.boxes.centers[~is_there])
    before = laid.boxes.take(is_there)
    to_box = maps_to(before)
    is_round = laid.is_plain[is_there] | (not BrushSet.of(coat.texture).is_directed)
    from_box = _maps_from(boxes, rows[is_there], before, is_round)
    moved = np.einsum("mij,mjk->mik", from_box[:, :, :2], to_box)
    moved[:, :, 2] += from_box[:, :, 2]
    moved[:, :, :2] -= np.eye(2)
    maps[is_there] = moved
    return maps


def maps_to(boxes: Boxes) -> F64:
    """[M, 2, 3] maps from the picture to box coordinates, -1 to 1 along u and v."""
    c, s = _axes(boxes.angles.astype(np.float64))
    half = np.maximum(boxes.half_extents.astype(np.float64), TINY)
    linear = np.stack([np.stack([c, s], 1), np.stack([-s, c], 1)], 1) / half[:, :, None]
    offset = -np.einsum("mij,mj->mi", linear, boxes.centers.astype(np.float64))
    return np.concatenate([linear, offset[:, :, None]], axis=2)


def _maps_from(boxes: Boxes, rows: Rows, before: Boxes, is_round: Mask) -> F64:
    """[M, 2, 3] maps from box coordinates to the picture, for `rows` of boxes that were the boxes `before`.

    A round box has four equal orientations, and its axes may swap although it hardly moves: the map with the
    smallest rotation is used.
    """
    angles, half = boxes.angles[rows].astype(np.float64), boxes.half_extents[rows].astype(np.float64)
    quarters = np.where(is_round, np.rint((angles - before.angles) / (np.pi / 2)), 0)
    half = np.where((quarters % 2 == 1)[:, None], half[:, ::-1], half)
    c, s = _axes(angles - quarters * (np.pi / 2))
    linear = np.stack([np.stack([c, -s], 1), np.stack([s, c], 1)], 1) * half[:, None, :]
    return np.concatenate([linear, boxes.centers[rows].astype(np.float64)[:, :, None]], axis=2)


def _axes(angles: F64) -> tuple[F64, F64]:
    return np.cos(angles), np.sin(angles)


def _shifts(shifts: F64) -> F64:
    """[M, 2, 3] maps to constant shifts."""
    maps = np.zeros((len(shifts), 2, 3))
    maps[:, :, 2] = shifts
    return maps


def projected(coat: "Coat", ids: NDArray[np.int32], camera: Camera) -> F64:
    """[M, 2] projected centers of rows of a coat, pixels; camera z is clamped to the near plane."""
    means = np.concatenate([coat.strokes.means, *([] if coat.plain is None else [coat.plain.means])])[ids]
    at = means.astype(np.float64) @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
    z = np.maximum(at[:, 2:], camera.near)
    return np.asarray(at[:, :2] / z * np.diag(camera.K)[:2] + camera.K[:2, 2])
