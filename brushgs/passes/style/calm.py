"""The calm parts of a painting, without its figures: what a stage around a subject is made of.

A color is calm if it occurs at about the same height across more than half of the painting's width and at one
of its sides, and if it is connected to the border. Trees, moons, figures and faces fail one of these tests;
their place is filled from around them, so that none of their color is left. Places whose color varies fast
along a row, such as foam, leaves and crowds, are not calm either.
"""

import numpy as np
from scipy.ndimage import binary_dilation, binary_opening, gaussian_filter, gaussian_filter1d, label
from scipy.spatial import cKDTree

from brushgs.values.arrays import F64, Mask

PARTS, LEAST_PARTS = 10, 6  # vertical strips of a painting; how many of them must contain a calm color
HEIGHT = 0.25  # OKLab: weight of the height, as the color difference between top and bottom
NEIGHBORS = 5  # cells of a strip that must have a color
SIDE = 0.12  # share of the width that counts as a side
EDGE = 0.04  # share of width and height that counts as the border
# OKLab distances up to which colors count as equal: the first that makes enough of the painting calm is used.
TOLERANCES = (0.04, 0.05, 0.065, 0.085, 0.11)
ENOUGH = 0.3
SMOOTH = 1.0  # cells
# Largest deviation of colors along a calm row, OKLab: for paint, for a print (its areas are flat), and for
# when too little is calm otherwise. Swirls of paint have 0.03 to 0.05, foam and crowds 0.06 and more.
QUIET, QUIET_PRINT, LESS_QUIET = 0.06, 0.045, 0.08
ENOUGH_QUIET = 0.2
ALONG, ROWS_NEAR = 3.0, 2.0  # cells: standard deviations of the window in which the deviation is measured
LEAST_QUIET = 2  # cells: half of the shorter side of the smallest quiet place
OUTLINE = 2  # cells beside a figure that contain some of its color
FILLS = (1.5, 3.0, 6.0, 12.0, 24.0, 48.0)  # cells: blurs for gaps; the narrowest that reaches is used
REACHES = 0.02  # weight from which a blur counts as reaching a cell


def calm_cells(lab: F64, flatness: float = 0.0) -> Mask:
    """Mask [h, w] of the cells of a painting that belong to its calm surroundings.

    Args:
        lab: [h, w, 3] OKLab.
        flatness: how much the painting is a print, 0 to 1.
    """
    height, width = lab.shape[:2]
    smooth = np.stack([gaussian_filter(lab[..., k], SMOOTH) for k in range(3)], axis=-1)
    rows = np.broadcast_to(HEIGHT * np.arange(height)[:, None] / height, (height, width))
    points = np.concatenate([smooth, rows[..., None]], axis=-1)
    away = []
    for part in np.array_split(points, PARTS, axis=1):
        tree = cKDTree(part.reshape(-1, 4))
        away.append(tree.query(points.reshape(-1, 4), k=[NEIGHBORS])[0].reshape(height, width))
    side = max(round(SIDE * width), 1)
    sides = cKDTree(np.concatenate([points[:, :side], points[:, -side:]], axis=1).reshape(-1, 4))
    beside = sides.query(points.reshape(-1, 4), k=[NEIGHBORS])[0].reshape(height, width)
    distance = np.maximum(np.sort(away, axis=0)[LEAST_PARTS - 1], beside)
    border = np.ones((height, width), bool)
    down, right = max(round(EDGE * height), 1), max(round(EDGE * width), 1)
    border[down:-down, right:-right] = False
    found = np.zeros((height, width), bool)
    for tolerance in TOLERANCES:
        labels, _ = label(distance < tolerance)
        kept = np.unique(labels[border])
        found = np.isin(labels, kept[kept > 0])
        if found.mean() >= ENOUGH:
            break
    figure = binary_opening(~found, iterations=1)  # single cells are marks, not figures
    calm = ~binary_dilation(figure, iterations=OUTLINE) & found
    calm = calm if calm.any() else found if found.any() else border
    deviation = _deviation(lab)
    for most in (QUIET + flatness * (QUIET_PRINT - QUIET), LESS_QUIET):
        quiet = binary_opening(calm & (deviation < most), iterations=LEAST_QUIET)
        if quiet.mean() >= ENOUGH_QUIET:
            return np.asarray(quiet)
    return np.asarray(calm)


def _deviation(lab: F64) -> F64:
    """[h, w] difference of colors [h, w, 3] from those beside them in the same row, OKLab."""
    means = gaussian_filter1d(lab, ALONG, axis=1)
    squares = gaussian_filter1d(((lab - means) ** 2).sum(axis=2), ALONG, axis=1)
    return np.asarray(np.sqrt(gaussian_filter1d(squares, ROWS_NEAR, axis=0)))


def filled(values: F64, known: Mask) -> F64:
    """Fields [h, w, k] with unknown cells filled by smooth continuation; known cells stay."""
    found, is_open = np.where(known[..., None], values, 0.0), ~known
    weights = known.astype(np.float64)
    start = found.copy()
    for blur in FILLS:
        if not is_open.any():
            break
        reached = gaussian_filter(weights, blur)
        rows = is_open & ((reached > REACHES) | (blur == FILLS[-1]))
        for k in range(values.shape[-1]):
            smooth = gaussian_filter(start[..., k], blur)
            found[rows, k] = smooth[rows] / np.maximum(reached[rows], 1e-12)
        is_open &= ~rows
    return found
