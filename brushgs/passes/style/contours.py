"""The dark contours of a painting: their width, their color, and their share of it.

A contour is a long dark ridge: what a closing of the lightness with a disc fills, spots excluded.
"""

import numpy as np
from scipy.ndimage import gaussian_filter, grey_closing, label

from brushgs.passes.color.color_space import oklab_planes
from brushgs.passes.style.averages import averaged, shorter_side
from brushgs.values.arrays import F64, Array
from brushgs.values.colors import rgb_of_oklab
from brushgs.values.style import StyleLines, StyleMarks

MOST_SIDE = 768  # pixels: larger paintings are averaged
WIDTHS = (1.0, 1.7, 3.0)  # disc widths to try, in widths of a mark
LEAST_DISC, WIDEST = 3, 0.027  # of the disc: pixels, and share of the longer side
DARKER = 0.1  # OKLab lightness: how much darker than both sides a contour is
LEAST_SHARE = 0.1  # share of a painting that contours must cover
LONG = 6.0  # least length over width of a ridge
DARKEST = 0.4  # darkest share of the ridges, which gives their color; the rest is mixed with paint
MOST_LIGHT = 0.55  # largest OKLab lightness of contours


def learn_lines(image: Array, marks: StyleMarks) -> StyleLines | None:
    """The contours of a painting [H, W, C]; None if it has none."""
    lab = oklab_planes(averaged(image, MOST_SIDE)).astype(np.float64)
    short, widest = shorter_side(lab.shape[1:]), WIDEST * max(lab.shape[1:])
    light = gaussian_filter(lab[0], 0.7)
    best: StyleLines | None = None
    for factor in WIDTHS:
        disc = int(np.clip(round(factor * marks.length / marks.aspect * short), LEAST_DISC, widest)) | 1
        found = _of_disc(lab, light, disc, short)
        if found is not None and (best is None or found.share > best.share):
            best = found
    return best if best is not None and best.share >= LEAST_SHARE else None


def _of_disc(lab: F64, light: F64, disc: int, short: float) -> StyleLines | None:
    y, x = np.mgrid[:disc, :disc] - disc // 2
    hat = grey_closing(light, footprint=x * x + y * y <= (0.5 * disc) ** 2) - light
    ridges = hat > DARKER
    labels, count = label(ridges, np.ones((3, 3)))
    if count == 0:
        return None
    # A ridge of width w and length l has area l w, and an outline of about 2 l pixels.
    inner = (
        ridges
        & np.roll(ridges, 1, 0)
        & np.roll(ridges, -1, 0)
        & np.roll(ridges, 1, 1)
        & np.roll(ridges, -1, 1)
    )
    areas = np.bincount(labels.ravel(), minlength=count + 1)[1:].astype(np.float64)
    outlines = areas - np.bincount(labels[inner].ravel(), minlength=count + 1)[1:]
    lengths = np.maximum(0.5 * outlines, 1)
    widths = areas / lengths
    is_long = lengths > LONG * widths
    if not is_long.any():
        return None
    rows = np.isin(labels, 1 + np.flatnonzero(is_long))
    dark = lab[:, rows]
    dark = dark[:, dark[0] <= np.quantile(dark[0], DARKEST)].mean(axis=1)
    if dark[0] > MOST_LIGHT:
        return None
    width = float(np.average(widths[is_long], weights=areas[is_long]))
    rgb = np.clip(rgb_of_oklab(dark[None])[0], 0, 1)
    return StyleLines(float(rows.mean()), width / short, rgb)
