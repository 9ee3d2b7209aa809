"""Cut a painted area of a picture into pieces along its skeleton, each as wide as the paint, at one depth.

Pieces overlap a little and share the paint there: if shares w sum to 1, layers of alpha 1 - (1 - a)^w
composite to exactly a, in any order.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.ndimage import distance_transform_edt, label, maximum_filter
from scipy.spatial import cKDTree

from brushgs.values.arrays import F64, Mask, Rows

LEAST_REACH = 16.0  # px, minimum reach of a piece
MOST_REACH = 1 / 20  # maximum reach, as a share of the shorter side of the picture
OVERLAP = 12.0  # px over which neighbors share the paint
NEIGHBOURS = 4  # maximum number of pieces that share a pixel
STEEP = 1.0
APART = 1e6  # px between areas that do not touch


@dataclass(frozen=True, eq=False)
class Pieces:
    """K pieces of the P pixels of a painted area.

    Attributes:
        rows: [P] rows of the pixels in the picture.
        columns: [P] columns of the pixels.
        piece: [P, n] pieces that share each pixel, nearest first.
        shares: [P, n] their shares of the paint, sum 1.
        count: K.
    """

    rows: Rows
    columns: Rows
    piece: Rows
    shares: F64
    count: int

    def pixels(self, piece: int) -> tuple[Rows, F64]:
        """The pixels of a piece with a share above 0, and the shares."""
        pixel, slot = self._places[piece]
        return pixel, self.shares[pixel, slot]

    @cached_property
    def _places(self) -> list[tuple[Rows, Rows]]:
        """The pixels of each piece, and the column of each in `piece`."""
        pixel, slot = np.nonzero(self.shares)
        piece = self.piece[pixel, slot]
        order = np.argsort(piece, kind="stable")
        ends = np.searchsorted(piece[order], np.arange(1, self.count))
        return list(zip(np.split(pixel[order], ends), np.split(slot[order], ends), strict=True))


def cut(painted: Mask, log_depth: F64, focal: float) -> Pieces:
    """Cut a painted area into pieces.

    Seeds are taken on the skeleton, the local maxima of the distance to the border, then in the remaining
    paint; each claims the pixels within the local width of the paint. Paint is cut where depth jumps.

    Args:
        painted: [H, W], not all False.
        log_depth: [H, W] logarithm of camera z of the surface below, finite where painted.
        focal: px.
    """
    inside = distance_transform_edt(np.pad(painted, 1))[1:-1, 1:-1]
    is_ridge = painted & (inside >= maximum_filter(inside, 3))
    areas, _ = label(painted, np.ones((3, 3)))
    rows, columns = np.nonzero(painted)
    away = STEEP * focal * log_depth[rows, columns]
    points = np.stack([columns, rows, away, APART * areas[rows, columns]], axis=1)
    reach = np.clip(2 * inside[rows, columns], LEAST_REACH, max(LEAST_REACH, MOST_REACH * min(painted.shape)))
    tree, is_left = cKDTree(points), np.ones(len(points), bool)
    seeds: list[int] = []
    for pixel in np.argsort(~is_ridge[rows, columns], kind="stable"):
        if is_left[pixel]:
            seeds.append(int(pixel))
            is_left[tree.query_ball_point(points[pixel], reach[pixel])] = False
    distances, piece = cKDTree(points[seeds]).query(points, k=NEIGHBOURS)
    closeness = np.clip(1 - (distances - distances[:, :1]) / OVERLAP, 0, 1)
    closeness[piece == len(seeds)] = 0  # there are fewer seeds
    return Pieces(
        rows,
        columns,
        np.minimum(piece, len(seeds) - 1),
        closeness / closeness.sum(axis=1, keepdims=True),
        len(seeds),
    )
