"""The color of a painting's ground, if there is evidence that it shows between marks.

A ground has one color and shows all over the picture in small pieces, which have the shape of gaps between
marks: they are not convex. If one of these conditions fails, no ground is reported.
"""

import numpy as np

from brushgs.passes.color.color_space import oklab_planes
from brushgs.passes.style.averages import averaged
from brushgs.passes.style.outlines import hull_area
from brushgs.values.arrays import F32, F64, Mask
from brushgs.values.colors import rgb_of_oklab

MOST_SIDE = 512  # pixels
BIN = 0.02  # of the color histogram, OKLab
NEAR = 0.025  # OKLab distance within which pixels belong to the ground
AROUND = 0.06
LEAST_SHARE, MOST_SHARE = 0.02, 0.7  # of the picture
# Least share of the pixels within `AROUND` that lie within `NEAR`: 0.4 for a color inside a ramp of colors,
# 0.6 to 0.73 for the ends of a ramp, 0.82 to 0.89 for grounds. The rest are edges,
# where the ground mixes with paint.
PEAKED = 0.78
CELLS, LEAST_CELLS = 6, 0.75  # cells along each side of the picture; share of them that must show the ground
IN_CELL = 0.004  # share of a cell that the ground must cover
NUM_CANDIDATES = 6
BAYS = 0.8  # largest share of their convex outlines that pieces fill, mean by area: marks fill 0.85 and more
LEAST_PIECE, MOST_PIECES = 12, 200  # pixels of the smallest piece, and number of pieces examined


def find_ground(rgb: F32) -> F64 | None:
    """The color [3] of the ground of a painting [H, W, 3], display-encoded; None without evidence."""
    lab = oklab_planes(averaged(rgb, MOST_SIDE))
    for color in _frequent(lab):
        distance = np.sqrt(((lab - color[:, None, None]) ** 2).sum(axis=0))
        is_near = distance < NEAR
        near, around = float(is_near.mean()), float((distance < AROUND).mean())
        if not LEAST_SHARE <= near <= MOST_SHARE or near < PEAKED * around:
            continue
        if _cells_with(is_near) >= LEAST_CELLS and _fill(is_near) <= BAYS:
            exact = lab[:, is_near].astype(np.float64).mean(axis=1)
            return np.asarray(np.clip(rgb_of_oklab(exact[None])[0], 0, 1))
    return None


def _frequent(lab: F32) -> F64:
    """The most frequent colors, [n, 3]."""
    places = np.floor(lab.reshape(3, -1) / BIN).astype(np.int64)
    places -= places.min(axis=1, keepdims=True)
    sizes = places.max(axis=1) + 1
    flat = np.ravel_multi_index(tuple(places), tuple(sizes))
    counts = np.bincount(flat)
    best = np.argsort(-counts, kind="stable")[:NUM_CANDIDATES]
    colors = lab.reshape(3, -1).astype(np.float64)
    return np.stack([colors[:, flat == one].mean(axis=1) for one in best if counts[one] > 0])


def _cells_with(is_near: Mask) -> float:
    """Share of the cells of the picture that show a color."""
    rows, columns = (np.array_split(np.arange(n), CELLS) for n in is_near.shape)
    shares = [is_near[np.ix_(row, column)].mean() for row in rows for column in columns]
    return float(np.mean(np.array(shares) >= IN_CELL))


def _fill(is_near: Mask) -> float:
    """Share of their convex outlines that pieces fill, mean by area of the outlines; 1 without pieces."""
    from scipy.ndimage import find_objects, label

    labels, count = label(is_near)
    areas = np.bincount(labels.ravel(), minlength=count + 1)[1:]
    boxes, filled, outlined = find_objects(labels), 0.0, 0.0
    for piece in np.argsort(-areas, kind="stable")[:MOST_PIECES]:
        if areas[piece] >= LEAST_PIECE:
            rows, columns = np.nonzero(labels[boxes[piece]] == piece + 1)
            filled += float(areas[piece])
            outlined += hull_area(columns.astype(np.float64), rows.astype(np.float64))
    return filled / outlined if outlined else 1.0
