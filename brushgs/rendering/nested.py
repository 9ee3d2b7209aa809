"""Marks in nested levels, whose density and width on paper do not depend on distance.

Each mark stores the gap to the next mark of its level. Where that gap is smaller on paper than its tone
requires, the mark fades: from far away coarse levels are enough, from nearby finer ones appear between them.
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
THINNEST = 0.7  # px, half width
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

    def of(self, boxes: Boxes, strokes: Gaussians, camera: Camera) -> Boxes:
        """Set the widths of the boxes of these strokes in a view; marks that are gone get opacity 0.

        Marks thinner than `THINNEST` get that width and a lower opacity, so that none falls between pixels.
        """
        ids = boxes.ids
        scale = scale_of(camera)
        shares = self.shares(strokes.means[ids], ids, boxes.angles, camera)
        halves = boxes.half_extents.copy()
        widths = 0.5 * scale * self.widths[ids] * (np.sqrt(shares) if self.is_round else shares)
        thin = np.minimum(widths / THINNEST, 1)
        halves[:, 1] = np.maximum(widths, THINNEST)
        if self.is_round:
            halves[:, 0], thin = halves[:, 1], thin**2
        opacities = (boxes.opacities * thin).astype(boxes.opacities.dtype)
        return replace(boxes, half_extents=halves, opacities=opacities)

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
