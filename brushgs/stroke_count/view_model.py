"""A model of strokes in one view of a scene: their error to the plain picture, their size and their cost.

Costs are modeled, not timed, so that they are the same on every machine and in every run:

    frame    = PIXEL x pixels of the picture + STROKE x strokes + PAINT x pixels of their boxes
    painting = frame + MAKE x strokes, and where they are fewer than Gaussians
               START + CLUSTER x Gaussians + CUT x strokes
    choosing = LOOK + SEARCH x Gaussians

On nine real scenes at two sizes, from 128 strokes to all, modeled frame times follow measured ones of one
core within 10 % (standard deviation of the logarithm, each curve scaled to fit). Refitting the constants
without a scene changes its number of strokes by at most 4 %.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from brushgs.brushes.brush_set import Brushes
from brushgs.brushes.texture import StrokeTexture
from brushgs.options.choices import Cost
from brushgs.rendering.areas import seen_areas
from brushgs.rendering.options import RenderOptions, project_with, rasterize_with
from brushgs.values.arrays import Array
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians

KERNEL = "gaussian"  # of the plain picture
# Nanoseconds of one core, least squares of relative errors; a second measurement gave 4.0, 208, 1.5 and 0.6
# (examples.benchmarks.stroke_count --cost). Only ratios matter: a stroke costs as much as 50 pixels.
PIXEL, STROKE = 3.5, 190.0
PAINT = {"image": 1.2, "gaussian": 0.6, "ellipse": 0.6}
# The same for plain paintings by two cores, 12 scenes (python -m examples.benchmarks.stroke_count --still):
# clustering with views, within 11 %; passes on strokes, within 10 %; and choosing the count.
START, CLUSTER, CUT, MAKE = 84e6, 4000.0, 42e3, 16e3
LOOK, SEARCH = 58e6, 4600.0


@dataclass(frozen=True, eq=False)
class ViewModel:
    """Rendering of strokes in one view, and the plain picture to compare with.

    Attributes:
        camera: the view.
        texture: the brush or brushes.
        options: of rendering; the lock "track" does not apply.
        plain: the plain picture.
        background: [3] color or [H, W, 3] picture, 0 to 1, on which both are compared.
    """

    camera: Camera
    texture: Brushes
    options: RenderOptions
    plain: Frame
    background: Array

    def boxes(self, strokes: Gaussians) -> Boxes:
        """The boxes that `render` would paint."""
        return project_with(strokes, self.camera, self.options)[0]

    @cached_property
    def of_kernel(self) -> "ViewModel":
        """The same with the kernel of the plain picture: its errors are those of clustering."""
        kernel = StrokeTexture.open(KERNEL)
        options = RenderOptions.of(
            kernel, num_sigmas=kernel.num_sigmas, depth=False, num_threads=self.options.num_threads
        )
        return replace(self, texture=kernel, options=options)

    def rmse(self, boxes: Boxes, row_step: int = 1) -> float:
        """RMSE of the painting to the plain picture, of 1; over every `row_step`-th row of pixels."""
        options = replace(self.options, depth=False)
        frame = rasterize_with(boxes, self.camera, self.texture, options)
        difference = self._shown(frame, row_step) - self._shown(self.plain, row_step)
        return float(np.sqrt(np.mean(np.square(difference), dtype=np.float64)))

    def _shown(self, frame: Frame, row_step: int) -> Array:
        """The frame on the background, clipped to 0 to 1: rows of [H, W, 3]."""
        background = np.asarray(self.background, dtype=frame.rgb.dtype)
        background = background if background.ndim == 1 else background[::row_step]
        picture = (1 - frame.alpha[::row_step, :, None]) * background
        picture += frame.rgb[::row_step]
        return np.clip(picture, 0, 1, out=picture)

    def size(self, boxes: Boxes) -> float:
        """See `typical_size`."""
        return typical_size(boxes, width=self.camera.width, height=self.camera.height)

    def cost(self, strokes: Gaussians, boxes: Boxes, num_gaussians: int, cost: Cost = "frame") -> float:
        """Modeled seconds for a frame of strokes, or for a painting of `num_gaussians` with them."""
        width, height = self.camera.width, self.camera.height
        painted = float(seen_areas(boxes, width, height).sum())
        total = PIXEL * width * height + STROKE * len(strokes) + PAINT[self.texture.kind] * painted
        return 1e-9 * total + (seconds_to_make(len(strokes), num_gaussians) if cost == "painting" else 0.0)


def seconds_to_make(num_strokes: int, num_gaussians: int) -> float:
    """Modeled seconds for making strokes: clustering, unless each Gaussian is one, and passes."""
    merging = START + CLUSTER * num_gaussians + CUT * num_strokes if num_strokes < num_gaussians else 0.0
    return 1e-9 * (MAKE * num_strokes + merging)


def saves_by_merging(num_gaussians: int) -> bool:
    """Whether a still can be painted sooner by choosing fewer strokes than Gaussians, however few."""
    saved = (MAKE - CLUSTER - SEARCH) * num_gaussians
    return saved > START + LOOK


def typical_size(boxes: Boxes, *, width: int, height: int) -> float:
    """Typical length of strokes, pixels: half of the paint is in strokes at least as long.

    The weighted median of the longer sides of boxes, with weight area x share of the bounding rectangle
    inside the picture x opacity. So neither many faint small strokes nor one background wash dominate.

    Args:
        boxes: M strokes.
        width: of the picture, pixels.
        height: of the picture, pixels.

    Returns:
        The length; 0 if nothing is visible.
    """
    weights = seen_areas(boxes, width, height) * boxes.opacities
    if not weights.any():
        return 0.0
    lengths = 2 * boxes.half_extents.max(axis=1).astype(np.float64)
    order = np.argsort(lengths, kind="stable")
    total = np.cumsum(weights[order])
    return float(lengths[order][np.searchsorted(total, 0.5 * total[-1])])
