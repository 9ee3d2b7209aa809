"""The truth of the texture filters: the same boxes with many samples per pixel."""

from dataclasses import replace

import numpy as np

from brushgs.brushes.brush_set import Brushes
from brushgs.rendering.rasterize import rasterize
from brushgs.rendering.underpaint import Underpaint
from brushgs.values.boxes import Boxes
from brushgs.values.frame import Frame

FACTOR = 8  # samples per pixel along each side
STRIP = 32  # rows of the picture at a time: 8 x 8 samples of a whole picture take gigabytes


def supersampled(
    boxes: Boxes,
    texture: Brushes,
    *,
    height: int,
    width: int,
    underpaint: Underpaint | None = None,
    streaks: float = 0.0,
    num_threads: int | None = None,
) -> Frame:
    """The mean of 8 x 8 bilinear samples per pixel, premultiplied, in the dtype of the boxes.

    The boxes are only enlarged: they keep the low-pass of the small picture.
    """
    rgb, alpha = [], []
    large = replace(boxes, centers=FACTOR * boxes.centers, half_extents=FACTOR * boxes.half_extents)
    reach = np.hypot(*large.half_extents.T) * (1.0 if underpaint is None else max(1.0, underpaint.reach))
    for top in range(0, height, STRIP):
        rows = min(STRIP, height - top)
        y = large.centers[:, 1] - FACTOR * top
        is_near = (y + reach > 0) & (y - reach < FACTOR * rows)
        strip = replace(large, centers=np.stack([large.centers[:, 0], y], axis=1)).take(is_near)
        frame = rasterize(
            strip,
            texture,
            height=FACTOR * rows,
            width=FACTOR * width,
            filter="bilinear",
            depth=False,
            underpaint=underpaint,
            streaks=streaks,
            num_threads=num_threads,
        )
        blocks = rows, FACTOR, width, FACTOR
        rgb.append(frame.rgb.reshape(*blocks, 3).mean(axis=(1, 3)))
        alpha.append(frame.alpha.reshape(blocks).mean(axis=(1, 3)))
    return Frame(np.concatenate(rgb), np.concatenate(alpha))
