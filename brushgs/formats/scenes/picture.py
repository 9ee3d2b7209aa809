"""Turn a photograph into a scene of one layer: a plane of Gaussians, smaller where the picture has detail.

The plane lies one unit in front of its camera; up is -y. A quadtree divides the picture: cells with little
variation of lightness stay large.
"""

from contextlib import nullcontext
from math import radians, tan
from pathlib import Path

import numpy as np

from brushgs.errors import NoGaussiansError
from brushgs.formats.pictures.images import read_image
from brushgs.formats.scenes.columns import Columns
from brushgs.formats.scenes.rows import RowSource, SceneFile
from brushgs.values.arrays import F32
from brushgs.values.camera import Camera
from brushgs.values.colors import split_alpha
from brushgs.values.sh import C0

LARGEST = 16  # pixels a side of the largest cell, a power of 2
MOST_CELLS = 500_000  # cells of the smallest size, which grows with the picture
VARIED = 0.02  # standard deviation of display-encoded lightness above which a cell is divided
REACH, THIN = 0.6, 0.05  # standard deviation of a Gaussian in cell sides; its factor across the plane
OPACITY, FAINTEST = 0.98, 0.5  # opacity of a Gaussian, and least alpha of a cell with a Gaussian
FOV_Y = radians(50.0)
MOST_PIXELS = 50_000_000
_BLOCK_ROWS = 1 << 16


def open_scene(path: Path) -> SceneFile:
    """Divide a picture into Gaussians.

    Raises:
        SceneError: if the file is no picture, is damaged or too large, or is wholly transparent.
    """
    picture = read_image(path, max_pixels=MOST_PIXELS)
    height, width = picture.shape[:2]
    focal = 0.5 * height / tan(0.5 * FOV_Y)
    K = np.array([[focal, 0, 0.5 * width], [0, focal, 0.5 * height], [0, 0, 1]])
    cells = _cells(picture)
    rows = cells[cells[:, 6] >= FAINTEST]
    if len(rows) == 0:
        raise NoGaussiansError(path, "shows nothing: all of it is transparent; give another picture")

    def decode(start: int, stop: int, out: Columns) -> None:
        x, y, side, *rgb, alpha = rows[start:stop].T
        out.means[:, 0], out.means[:, 1] = (x - 0.5 * width) / focal, (y - 0.5 * height) / focal
        out.means[:, 2] = 1
        out.scales[:] = (REACH * side / focal)[:, None] * np.array([1, 1, THIN], np.float32)
        out.quats[:] = 1, 0, 0, 0
        out.opacities[:] = OPACITY * alpha
        out.sh[:, 0] = (np.stack(rgb, axis=1) - 0.5) / C0

    source = RowSource(len(rows), 1, lambda: nullcontext(decode), block_rows=_BLOCK_ROWS, is_active=True)
    name = f"picture of {width}x{height} pixels, a plane of Gaussians"
    camera = Camera(np.eye(4), K, width, height)
    return SceneFile(path, name, len(rows), 1, lambda: source, up="-y", photograph=camera)


def _cells(picture: F32) -> F32:
    """[n, 7] center x and y and side of each cell in pixels, its mean RGB and its mean alpha."""
    rgb, alpha = split_alpha(picture)
    height, width = rgb.shape[:2]
    smallest = 1
    while height * width > MOST_CELLS * smallest**2:
        smallest *= 2
    largest = max(LARGEST, smallest)
    # Extend the plane around the picture, since paint would be thin at its border.
    pad = (largest, largest + -height % largest), (largest, largest + -width % largest)
    alpha = np.ones((height, width), np.float32) if alpha is None else alpha
    planes = np.pad(np.dstack([rgb, alpha]), (*pad, (0, 0)), mode="edge")
    found, side = [], largest
    is_open = np.ones((planes.shape[0] // side, planes.shape[1] // side), bool)
    while True:
        blocks = planes.reshape(is_open.shape[0], side, is_open.shape[1], side, 4)
        means = blocks.mean(axis=(1, 3))
        varies = blocks[..., :3].mean(axis=4).std(axis=(1, 3)) > VARIED
        is_last = side == smallest
        rows, columns = np.nonzero(is_open & (is_last | ~varies))
        middles = (np.stack([columns, rows], axis=1) + np.float32(0.5)) * np.float32(side) - largest
        found.append(np.column_stack([middles, np.full(len(rows), side, np.float32), means[rows, columns]]))
        if is_last:
            return np.concatenate(found).astype(np.float32)
        is_open = np.kron(is_open & varies, np.ones((2, 2), bool)).astype(bool)
        side //= 2
