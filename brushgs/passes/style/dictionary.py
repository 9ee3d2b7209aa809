"""A dictionary of real marks, cut out of a painting along its flow, with their colors and relief.

Oblong pieces of about the size of a mark are taken all over the painting, turned to the direction of the
marks there. The middle of a piece gives the color of its mark; similar texels are paint, others are left out,
with soft and ragged ends. Colors are stored as differences from their mean, in OKLab: a mark can be laid in
any color and keeps its two-colored bristles or its lit ridge. A few hundred representatives are kept: the
middles of clusters in color, color change across the mark, contrast and length.
Source of the seeds of clusters: Arthur and Vassilvitskii 2007, k-means++.
"""

import warnings

import numpy as np
from numpy.typing import NDArray

from brushgs.passes.color.color_space import oklab_planes
from brushgs.passes.style.averages import shorter_side
from brushgs.passes.style.sizes import Sizes
from brushgs.values.arrays import F32, F64, Array
from brushgs.values.style import MarkDictionary

MANY, FEW = 192, 64  # marks of a dictionary, and of a small one
TEXELS = 64, 24  # of a mark, along and across
NUM_PIECES = 2500
LONG, WIDE = 1.25, 2.2  # size of a piece, in lengths and widths of a mark
MOST_ASPECT = 4.5  # of a piece: longer ones bend in the painting
LEAST_PIXELS = 8  # across a piece
CORE_LONG, CORE_WIDE = 0.6, 0.3  # middle of a piece, which belongs to its mark; in lengths and widths
LIKE = 0.11  # OKLab: deviation of colors within one mark
FAINT = 0.08  # coverage left where a texel is unlike the mark
WEIGHTS = (1.0, 0.6, 0.6, 0.15)  # of color, color change across, contrast and length, in clustering
ROUNDS = 12  # of k-means


def cut_dictionary(image: Array, sizes: Sizes, num: int = MANY) -> MarkDictionary | None:
    """Cut the marks of a painting.

    Args:
        image: [H, W, 3] a painting, 0 to 1.
        sizes: of its marks.
        num: largest number of marks.

    Returns:
        The marks, the most frequent kinds first; None if the painting is too small for any.
    """
    lab = oklab_planes(image).astype(np.float32)
    short = shorter_side(lab.shape[1:])
    width = max(WIDE * sizes.width * short, LEAST_PIXELS)
    length = float(np.clip(LONG * sizes.length * short, 1.5 * width, MOST_ASPECT * width))
    assert sizes.flow is not None, "sizes are measured with the flow"
    angles = _enlarged(sizes.flow[0], lab.shape[1:])
    places = _places(lab.shape[1:], 0.5 * np.hypot(length, width) + 1)
    if len(places) < num:
        return None
    pieces = _cut(lab, places, angles, length, width)
    coverage = _coverage(pieces)
    means = np.einsum("nchw,nhw->nc", pieces, coverage) / coverage.sum(axis=(1, 2))[:, None]
    rows, shares = _representatives(_features(pieces, coverage, means), num)
    residuals = pieces[rows] - means[rows][:, :, None, None]
    return MarkDictionary.of_residuals(means[rows], residuals, coverage[rows], shares)


def _enlarged(plane: Array, shape: tuple[int, ...]) -> Array:
    """A plane enlarged to the size of a larger picture of the same painting, by nearest neighbor."""
    rows, columns = (np.arange(n) * size // n for n, size in zip(shape, plane.shape, strict=True))
    return np.asarray(plane[rows[:, None], columns])


def _places(shape: tuple[int, ...], margin: float) -> NDArray[np.intp]:
    """[n, 2] (y, x), evenly over the painting, so that calm parts get their share of the marks."""
    away = int(np.ceil(margin))
    if 2 * away >= min(shape):
        return np.empty((0, 2), np.intp)
    return np.random.default_rng(0).integers(away, np.array(shape) - away, (NUM_PIECES, 2))


def _cut(lab: F32, places: NDArray[np.intp], angles: Array, length: float, width: float) -> F32:
    """[n, 3, h, w] pieces around places, their marks along the rows."""
    from scipy.ndimage import gaussian_filter

    columns, rows = TEXELS
    blur = 0.35 * max(length / columns, width / rows)  # antialiasing, if a texel is larger than a pixel
    planes = lab if blur < 0.4 else np.stack([gaussian_filter(plane, blur) for plane in lab])
    u = (np.arange(columns) + 0.5 - columns / 2) * (length / columns)
    v = ((np.arange(rows) + 0.5 - rows / 2) * (width / rows))[:, None]
    found = np.empty((len(places), 3, rows, columns), np.float32)
    for i, (y, x) in enumerate(places):
        cosine, sine = np.cos(angles[y, x]), np.sin(angles[y, x])
        px, py = x + cosine * u - sine * v, y + sine * u + cosine * v
        j, k = px.astype(np.intp), py.astype(np.intp)
        right, below = (px - j).astype(np.float32), (py - k).astype(np.float32)
        upper = planes[:, k, j] * (1 - right) + planes[:, k, j + 1] * right
        lower = planes[:, k + 1, j] * (1 - right) + planes[:, k + 1, j + 1] * right
        found[i] = upper * (1 - below) + lower * below
    return found


def _core(pieces: F32) -> F64:
    """[n, 3] the color of the mark in the middle of each piece."""
    rows, columns = pieces.shape[2:]
    high, long = round(rows * CORE_WIDE / 2), round(columns * CORE_LONG / 2)
    middle = pieces[:, :, rows // 2 - high : rows // 2 + high, columns // 2 - long : columns // 2 + long]
    return np.asarray(np.median(middle, axis=(2, 3)), np.float64)


def _coverage(pieces: F32) -> F32:
    """[n, h, w] how much each texel belongs to the mark, 0 to 1."""
    from scipy.ndimage import gaussian_filter

    rows, columns = pieces.shape[2:]
    u = np.abs((np.arange(columns) + 0.5) / (columns / 2) - 1)
    v = np.abs((np.arange(rows) + 0.5) / (rows / 2) - 1)[:, None]
    lens = np.clip(1.8 * (1 - u**4 - v**3), 0, 1)
    away = ((pieces - _core(pieces)[:, :, None, None].astype(np.float32)) ** 2).sum(axis=1)
    like = gaussian_filter(np.exp(-away / (2 * LIKE**2)), (0, 0.8, 1.2))
    # Ends are ragged: paint runs out first where it is least similar to the mark.
    ragged = np.clip(1.6 * lens - 0.6 * (1 - like), 0, 1)
    return np.asarray(ragged * np.clip(FAINT + 1.1 * like, 0, 1), np.float32)


def _features(pieces: F32, coverage: F32, means: F64) -> F64:
    """[n, F] features for clustering marks."""
    rows = pieces.shape[2]
    light = pieces[:, 0] - means[:, 0, None, None]
    weights = coverage / coverage.sum(axis=(1, 2))[:, None, None]
    across = 2 * (
        (weights * light)[:, : rows // 2].sum(axis=(1, 2))
        - (weights * light)[:, rows // 2 :].sum(axis=(1, 2))
    )
    contrast = np.sqrt((weights * light**2).sum(axis=(1, 2)))
    length = coverage.max(axis=1).mean(axis=1)
    color, change, varied, long = WEIGHTS
    return np.column_stack([color * means, change * np.abs(across), varied * contrast, long * length])


def _representatives(features: F64, num: int) -> tuple[NDArray[np.intp], F64]:
    """Rows nearest to the middles of clusters, largest cluster first, and the clusters' shares."""
    from scipy.cluster.vq import kmeans2

    with warnings.catch_warnings():  # of empty clusters, which are left out below
        warnings.simplefilter("ignore", UserWarning)
        centers, labels = kmeans2(features, num, iter=ROUNDS, minit="++", seed=0, missing="warn")
    rows, shares = [], []
    for k in range(num):
        own = np.flatnonzero(labels == k)
        if len(own):
            rows.append(own[np.argmin(((features[own] - centers[k]) ** 2).sum(axis=1))])
            shares.append(len(own) / len(features))
    order = np.argsort(-np.array(shares), kind="stable")
    return np.array(rows)[order], np.array(shares)[order]
