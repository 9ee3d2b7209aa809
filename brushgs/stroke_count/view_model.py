"""One view of a scene, and what strokes look like in it: how near to the plain picture, how long, how costly.

Costs are modelled, not timed, so that they are the same on every machine and in every run:

    cost = PIXEL x pixels of the picture + STROKE x strokes + PAINT x pixels of their boxes

On nine real scenes at two sizes, 128 strokes to all, that follows the seconds of one core within 10 % as far
as the shape of a curve goes (standard deviation of the logarithm, each curve scaled to fit). Fitted without a
scene, the constants choose at most 4 % fewer or more strokes for it.
"""

from dataclasses import dataclass, replace

import numpy as np

from brushgs.arrays import Array
from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering.areas import seen_areas
from brushgs.rendering.options import RenderOptions, project_with, rasterize_with
from brushgs.scene import Boxes, Camera, Frame, Gaussians

# Nanoseconds of one core, least squares of relative errors; measured again: 4.0, 208, 1.5 and 0.6 (python -m
# tests.bench.stroke_count --cost). Only ratios count: a stroke costs as much as 50 pixels of the picture.
PIXEL, STROKE = 3.5, 190.0
PAINT = {"image": 1.2, "gaussian": 0.6, "ellipse": 0.6}


@dataclass(frozen=True, eq=False)
class ViewModel:
    """What strokes are counted for: how one view of them is painted, and the picture they should come near.

    Attributes:
        camera: the view.
        texture: the stroke.
        options: how strokes become a frame of the view; "track" has no meaning in one.
        plain: the plain picture.
        background: [3] colour or [H, W, 3] picture, 0 to 1, on which both are compared.
    """

    camera: Camera
    texture: StrokeTexture
    options: RenderOptions
    plain: Frame
    background: Array

    def boxes(self, strokes: Gaussians) -> Boxes:
        """As `render` has them."""
        return project_with(strokes, self.camera, self.options)[0]

    def rmse(self, boxes: Boxes, row_step: int = 1) -> float:
        """Of the painting against the plain picture, of 1; over every n-th row of pixels."""
        options = replace(self.options, depth=False)
        frame = rasterize_with(boxes, self.camera, self.texture, options)
        apart = self._shown(frame, row_step) - self._shown(self.plain, row_step)
        return float(np.sqrt(np.mean(np.square(apart), dtype=np.float64)))

    def _shown(self, frame: Frame, row_step: int) -> Array:
        """What a screen shows of a frame on the ground: rows of [H, W, 3], 0 to 1."""
        ground = np.asarray(self.background, dtype=frame.rgb.dtype)
        ground = ground if ground.ndim == 1 else ground[::row_step]
        picture = (1 - frame.alpha[::row_step, :, None]) * ground
        picture += frame.rgb[::row_step]
        return np.clip(picture, 0, 1, out=picture)

    def size(self, boxes: Boxes) -> float:
        """See `typical_size`."""
        return typical_size(boxes, width=self.camera.width, height=self.camera.height)

    def cost(self, strokes: Gaussians, boxes: Boxes) -> float:
        """Modelled seconds of one core for a frame."""
        width, height = self.camera.width, self.camera.height
        painted = float(seen_areas(boxes, width, height).sum())
        return 1e-9 * (PIXEL * width * height + STROKE * len(strokes) + PAINT[self.texture.kind] * painted)


def typical_size(boxes: Boxes, *, width: int, height: int) -> float:
    """Typical length of strokes, pixels: half of the paint of a picture is in strokes at least as long.

    The length is that of the longer side of a box. Strokes weigh by what they paint: area of the box x share
    of its upright bounding rectangle inside the picture x opacity. So neither the many small ones that hardly
    show nor one wash in the background decide.

    Args:
        boxes: M strokes.
        width: of the picture, pixels.
        height: of the picture, pixels.

    Returns:
        The weighted median; 0 where nothing is seen.
    """
    weights = seen_areas(boxes, width, height) * boxes.opacities
    if not weights.any():
        return 0.0
    lengths = 2 * boxes.half_extents.max(axis=1).astype(np.float64)
    order = np.argsort(lengths, kind="stable")
    total = np.cumsum(weights[order])
    return float(lengths[order][np.searchsorted(total, 0.5 * total[-1])])
