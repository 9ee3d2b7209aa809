"""Convert marks to strokes with brushes, whose u axis lies along the longest axis of the stroke."""

import numpy as np

from brushgs.brushes.texture import StrokeTexture, Tint
from brushgs.values.arrays import U8
from brushgs.values.gaussians import Gaussians
from brushgs.values.marks import Marks
from brushgs.values.quats import quats_of
from brushgs.values.sh import in_colors

SIGMAS = 2.0  # half length of a mark in standard deviations


def strokes_of(marks: Marks) -> Gaussians:
    """N strokes in the planes of the marks; half a side is `SIGMAS` standard deviations."""
    across = np.cross(marks.directions, marks.normals)
    axes = np.stack([marks.directions, across, -marks.normals], axis=2)  # right-handed
    axes[..., 1] /= np.linalg.norm(axes[..., 1], axis=1, keepdims=True)
    axes[..., 2] = np.cross(axes[..., 0], axes[..., 1])
    sides = np.stack([marks.lengths, marks.widths, np.zeros(len(marks))], axis=1)
    strokes = Gaussians(
        marks.means.astype(np.float32),
        quats_of(axes).astype(np.float32),
        (sides / (2 * SIGMAS)).astype(np.float32),
        marks.opacities.astype(np.float32),
        np.zeros((len(marks), 1, 3), np.float32),
    )
    return in_colors(strokes, marks.colors)


def brush_of(image: U8, name: str, *, is_turned: bool = False) -> StrokeTexture:
    """A brush with its own colors, from a tile.

    Args:
        image: uint8 [h, w, 4], straight alpha.
        name: of the brush.
        is_turned: whether the stroke is longer along the v axis of the tile, which then becomes u.
    """
    if is_turned:
        image = image.transpose(1, 0, 2)[::-1]
    coverage = np.ascontiguousarray(image[..., 3])
    tint = Tint.of(image[..., :3] / 255.0, coverage, mean_of(image))
    return StrokeTexture("image", name, coverage, has_bristles=False, num_sigmas=SIGMAS, tint=tint)


def mean_of(image: U8) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Mean color of the paint of a tile, 0 to 1, [3]."""
    weights = image[..., 3:].astype(np.float64)
    return np.asarray((weights * image[..., :3]).sum(axis=(0, 1)) / max(float(weights.sum()), 1.0) / 255)
