"""The sample for finding the first view: the thinned middle of a scene, and small pictures of it.

Evidence comes from pictures, as they account for occlusion.
"""

import numpy as np

from brushgs.brushes.texture import StrokeTexture
from brushgs.core.native import core as _core
from brushgs.rendering.options import RenderOptions, project_with, rasterize_with
from brushgs.values.arrays import Array, Mask, Rows
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians

SIDE = 96  # pixels
FAINTEST = 0.02  # opacity: below, haze


def take_sample(gaussians: Gaussians) -> _core.ViewSample | None:
    """The subject of N >= 1 Gaussians, thinned; None if nothing with extent is visible."""
    sample = _core.take_view_sample(**gaussians.columns())
    return sample if sample.count else None


def thin(gaussians: Gaussians, rows: Rows, most: int) -> Gaussians:
    """At most `most` of some rows, degree 0, with scales enlarged to compensate.

    With unchanged scales, a scene of 100,000 thinned to 15,000 shows its inside: probabilities of up fall by
    0.1.
    """
    chosen = rows[thinned(len(rows), most)]
    growth = gaussians.means.dtype.type(np.sqrt(len(rows) / len(chosen)))
    largest = np.finfo(gaussians.means.dtype).max / growth
    return Gaussians(
        gaussians.means[chosen],
        gaussians.quats[chosen],
        np.minimum(gaussians.scales[chosen], largest) * growth,
        gaussians.opacities[chosen],
        gaussians.sh[chosen, :1],
    )


def thinned(count: int, most: int) -> Rows:
    """At most `most` of `count` row numbers, ascending: one per equal part.

    Rows of compressed files are sorted along a space-filling curve, so equal parts are spread evenly in
    space.
    """
    return np.asarray(_core.thinned(count, most), np.intp)


class Painter:
    """Paints plain pictures for evidence, with or without depth."""

    def __init__(self, *, depth: bool = False) -> None:
        self.texture = StrokeTexture.open("gaussian")
        self.options = RenderOptions.of(self.texture, depth=depth)

    def __call__(self, gaussians: Gaussians, camera: Camera) -> Frame:
        """The picture of a camera."""
        return self.frame(self.boxes(gaussians, camera), camera)

    def boxes(self, gaussians: Gaussians, camera: Camera) -> Boxes:
        """The boxes of a camera, to paint several times in other colors."""
        return project_with(gaussians, camera, self.options)[0]

    def frame(self, boxes: Boxes, camera: Camera) -> Frame:
        """The picture of boxes."""
        return rasterize_with(boxes, camera, self.texture, self.options)


def gradients(shades: Array, mask: Mask) -> Array:
    """[H - 1, W - 1] length of the gradient between neighbors inside a mask, per pixel."""
    across = np.abs(np.diff(shades, axis=1))[:-1] * (mask[:-1, :-1] & mask[:-1, 1:])
    down = np.abs(np.diff(shades, axis=0))[:, :-1] * (mask[:-1, :-1] & mask[1:, :-1])
    return np.asarray(np.hypot(across, down))
