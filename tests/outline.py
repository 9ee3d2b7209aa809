"""How hard the outline of a painted subject is: shares of it that are lost and crisp.

The difference of a picture to the same without its subject (CIELAB) is followed along lines across the
outline. Lost is where it stays below 6 inside, or where it takes more than 8 pixels to fall, seen from where
2 pixels blur: single bristles are no edge. Crisp is where it falls in less than 2, unblurred. All pixels are
those of a picture of 1000 x 750.
"""

from typing import NamedTuple

import numpy as np
from scipy import ndimage

from brushgs.passes.color.color_space import Space

LOST_STEP, LOST_WIDTH, CRISP_WIDTH = 6.0, 8.0, 2.0
AWAY = 2.0  # pixels blurred at the distance from which a painting is seen
ALONG = 6  # pixels to both sides along the outline, averaged for lost edges; 1 for crisp ones
REACH, INSIDE, OUTSIDE = 16.0, 8.0, 12.0  # pixels across the outline: of lines, and of their ends


class Hardness(NamedTuple):
    """Of an outline: [n] rows and columns of its pixels, whether these are lost, and whether crisp."""

    rows: np.ndarray
    columns: np.ndarray
    lost: np.ndarray
    crisp: np.ndarray


def hardness_of(painted, empty, alpha):
    """Measure an outline.

    Args:
        painted: [h, w, 3] RGB, without relief.
        empty: the same without the subject.
        alpha: [h, w] of the plain subject: its outline is where it falls below 1/2.
    """
    unit = (alpha.size / 750_000) ** 0.5
    smooth = ndimage.gaussian_filter((alpha > 0.5).astype(float), 2 * unit)
    down, right = np.gradient(smooth)
    steep = np.hypot(down, right)
    on_edge = np.abs(smooth - 0.5) < 0.5 * steep
    border = int(np.ceil(REACH * unit))
    inner = np.zeros_like(on_edge)
    inner[border:-border, border:-border] = True
    rows, columns = np.nonzero(on_edge & inner)
    outward = -np.stack([down, right])[:, rows, columns] / steep[rows, columns]
    at = np.stack([rows, columns]).astype(float)
    step, width = _fall(_difference(painted, empty), at, outward, unit, 1)
    blur = (AWAY * unit, AWAY * unit, 0)
    seen = _difference(ndimage.gaussian_filter(painted, blur), ndimage.gaussian_filter(empty, blur))
    _, wide = _fall(seen, at, outward, unit, ALONG)
    wide = np.sqrt(np.maximum(wide**2 - 2 * np.pi * AWAY**2, 0))  # a step that was blurred has this width
    lost = (step < LOST_STEP) | (wide > LOST_WIDTH)
    return Hardness(rows, columns, lost, ~lost & (width < CRISP_WIDTH))


def _difference(one, other):
    labs = [100 * Space("lab").to(np.clip(rgb, 0, 1).reshape(-1, 3)) for rgb in (one, other)]
    return np.linalg.norm(labs[0] - labs[1], axis=1).reshape(one.shape[:2])


def _fall(difference, at, outward, unit, along):
    """[n] by how much a difference falls across an outline, and over how many pixels of 1000 x 750."""
    across = np.arange(-REACH, REACH + 0.25, 0.5)
    tangent = np.stack([-outward[1], outward[0]])
    lines = np.zeros((at.shape[1], len(across)))
    for aside in range(-along, along + 1):
        start = at + aside * unit * tangent
        places = start[:, :, None] + outward[:, :, None] * across * unit
        lines += ndimage.map_coordinates(difference, places, order=1, mode="nearest") / (2 * along + 1)
    step = np.median(lines[:, across < -INSIDE], axis=1) - np.median(lines[:, across > OUTSIDE], axis=1)
    slopes = (lines[:, :-2] - lines[:, 2:]).max(axis=1)  # over a pixel
    return step, step / np.maximum(slopes, 1e-9)
