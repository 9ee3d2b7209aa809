"""Marks in nested levels, whose density and width on paper do not depend on distance.

Each mark stores the gap to the next mark of its level. Where that gap is smaller on paper than its tone
requires, the mark goes: from far away coarse levels are enough, from nearby finer ones appear between them.
Dots shrink. Lines get shorter from both ends, each as a whole: thin or broken ones would be grey crumbs.
Source: Praun et al. 2001, Real-Time Hatching (tonal art maps).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import F64, Array, Rows, smoothstep
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

GONE, WHOLE = 0.5, 0.9  # gap on paper over the required gap at which a mark is gone, and is whole
# px, half width. A pen of 0.8 is 1.24 px wide, and dark (L* 41) where it runs between two rows of pixels; of
# 0.7, grey (L* 50), so that slanted lines look dotted.
THINNEST, SMALLEST = 0.8, 0.7  # of lines, of dots
# px in a picture of `PIXELS`: what is left of a line on paper when it is gone, and when it is whole.
SHORT, LONG = 30.0, 36.0
LEAST_FACING = 0.1  # cosine of the angle between normal and view
PIXELS = 960 * 540  # picture that lengths refer to


def scale_of(camera: Camera) -> float:
    """Scale of lengths relative to a picture of `PIXELS` pixels: root of the ratio of the areas."""
    return float(np.sqrt(camera.width * camera.height / PIXELS))


@dataclass(frozen=True, eq=False)
class Nested:
    """Gaps and widths of the N marks of a coat in nested levels.

    Attributes:
        gaps: [N, 3] world units: for lines, the vector across the line to the next of its level; for dots,
            the surface normal times the distance to the next.
        spacings: [N] gap that the tone requires, px in a picture of `PIXELS` pixels.
        widths: [N] width of the mark, likewise.
        is_round: whether marks are dots.
    """

    gaps: Array
    spacings: F64
    widths: F64
    is_round: bool = False

    def of(self, boxes: Boxes, strokes: Gaussians, camera: Camera, chains: Rows | None = None) -> Boxes:
        """Set the sizes of the boxes of these strokes in a view; marks that are gone get opacity 0.

        Marks thinner than `THINNEST` or `SMALLEST` get that width and a lower opacity, so that none falls
        between pixels. `chains` [N] are the lines that strokes are pieces of, see `Coat`; dots need none.
        """
        ids, scale = boxes.ids, scale_of(camera)
        shares = self.shares(strokes.means[ids], ids, boxes.angles, camera)
        halves = 0.5 * scale * self.widths[ids]
        if not self.is_round:
            assert chains is not None, "lines have pieces"
            return _shortened(boxes, chains, shares, halves, scale)
        halves *= np.sqrt(shares)
        extents = np.maximum(halves, SMALLEST)[:, None].repeat(2, axis=1)
        return _sized(boxes, boxes.centers, extents, np.minimum(halves / SMALLEST, 1) ** 2)

    def shares(self, points: Array, ids: Rows | NDArray[np.int32], angles: Array, camera: Camera) -> F64:
        """[M] 0 (gone) to 1 (whole) for marks `ids` at points [M, 3] with angles [M] in the picture."""
        rotation = camera.viewmat[:3, :3]
        seen = points.astype(np.float64) @ rotation.T + camera.viewmat[:3, 3]
        z = np.maximum(seen[:, 2], camera.near)[:, None]
        gaps = self.gaps[ids].astype(np.float64) @ rotation.T
        focal = np.diag(camera.K)[:2]
        if self.is_round:
            lengths = np.linalg.norm(gaps, axis=1)
            away = np.linalg.norm(seen, axis=1)
            facing = np.abs((gaps * seen).sum(axis=1)) / np.maximum(lengths * away, 1e-300)
            on_paper = lengths / z[:, 0] * np.sqrt(focal.prod() * np.maximum(facing, LEAST_FACING))
        else:
            flat = (gaps[:, :2] - seen[:, :2] / z * gaps[:, 2:]) * focal / z
            on_paper = np.abs(flat[:, 1] * np.cos(angles) - flat[:, 0] * np.sin(angles))
        ratios = on_paper / np.maximum(scale_of(camera) * self.spacings[ids], 1e-12)
        return np.asarray(smoothstep((ratios - GONE) / (WHOLE - GONE)), np.float64)


def _sized(boxes: Boxes, centers: Array, extents: Array, opacities: F64) -> Boxes:
    """Boxes of other sizes at other places, of which opacities [M] are left."""
    dtype = boxes.centers.dtype
    return replace(
        boxes,
        centers=centers.astype(dtype),
        half_extents=extents.astype(dtype),
        opacities=(boxes.opacities * opacities).astype(dtype),
    )


def _shortened(boxes: Boxes, chains: Rows, shares: F64, halves: F64, scale: float) -> Boxes:
    """Lines cut from both ends to their shares; those that get too short are gone.

    Args:
        boxes: M pieces of lines, in the order of their ids along each line.
        chains: [N] line of each id; of those that the picture cuts off only some pieces have a box.
        shares: [M] 0 to 1; that of a line is the mean of its pieces.
        halves: [M] half widths, px. A line is as opaque as where it is widest: ends taper, but not to grey.
        scale: see `scale_of`.
    """
    order = np.argsort(boxes.ids)  # lines are ascending
    if not len(order):
        return boxes
    lines = chains[boxes.ids[order]]
    first = np.flatnonzero(np.diff(lines, prepend=-1))
    last = np.append(first[1:], len(order)) - 1
    line, rows = np.repeat(np.arange(len(first)), last - first + 1), np.arange(len(order))
    centers, extents = boxes.centers[order].astype(np.float64), boxes.half_extents[order].astype(np.float64)
    lengths = 2 * extents[:, 0]
    total, left = np.bincount(line, lengths), np.bincount(line, lengths * shares[order])
    ends = np.cumsum(lengths)
    ends -= (ends - lengths)[first][line]
    cut = 0.5 * (total - left)[line]
    begin, end = np.maximum(ends - lengths, cut), np.minimum(ends, total[line] - cut)
    is_left = end > begin
    angles = boxes.angles[order].astype(np.float64)
    axes = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    way = centers[np.minimum(rows + 1, last[line])] - centers[np.maximum(rows - 1, first[line])]
    shifts = np.where((axes * way).sum(axis=1) < 0, -0.5, 0.5) * (begin + end - 2 * ends + lengths)
    centers += (is_left * shifts)[:, None] * axes
    extents[:, 0] = np.where(is_left, 0.5 * (end - begin), extents[:, 0])
    extents[:, 1] = np.maximum(halves[order], THINNEST)
    opaque = np.minimum(np.maximum.reduceat(halves[order], first) / THINNEST, 1)
    beyond = np.bincount(chains)[lines[first]] / np.bincount(line)  # pieces, over those that have a box
    opaque *= smoothstep((left * beyond / scale - SHORT) / (LONG - SHORT))
    back = np.argsort(order)
    return _sized(boxes, centers[back], extents[back], (opaque[line] * is_left)[back])
