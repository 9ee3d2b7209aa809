"""Convert the height of brushes to normal maps, so that 3D programs can light the paint.

The height is that of `rasterize`, coverage x (thickness + gain x (h - 1/2)) in pixels of a picture of 1000 x
750, smoothed as in `light`. Its slope depends on the size of a stroke: a map is made for the median size of
the strokes of its brush. Texels are normals in the tangent space of glTF: x along u, y against v (up), z out
of the paint, with -1 to 1 stored as 0 to 255.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from brushgs.brushes.texture import StrokeTexture
from brushgs.outlets.glb.shape import Quads
from brushgs.rendering.light import BLUR
from brushgs.rendering.relief import Relief, canvas_scale
from brushgs.values.arrays import F64, U8
from brushgs.values.camera import Camera

FLAT = (128, 128, 255)  # the normal of flat paint
_STEEPEST = 4.0  # limit of the slope, pixels of height per pixel


@dataclass(frozen=True, eq=False)
class Bump:
    """Height of a brush in use.

    Attributes:
        texture: the brush.
        relief: of its coat.
        size: (along u, along v) of its median stroke, px of a picture of 1000 x 750.
    """

    texture: StrokeTexture
    relief: Relief
    size: F64  # [2]

    def normals(self) -> U8:
        """[h, w, 3] normal map; flat where the brush has no paint."""
        coverage = self.texture.coverage / 255.0
        own = 0.0 if self.texture.height is None else self.texture.height.astype(np.float64) - 0.5
        height = coverage * (self.relief.thickness + self.relief.gain * own)
        per_pixel = np.array(coverage.shape) / self.size[::-1]  # texels, down and along
        smooth = gaussian_filter(height, BLUR * per_pixel, mode="nearest")
        down, along = (slope * texels for slope, texels in zip(np.gradient(smooth), per_pixel, strict=True))
        slopes = np.clip(np.stack([-along, down], axis=2), -_STEEPEST, _STEEPEST)
        normals = np.append(slopes, np.ones((*coverage.shape, 1)), axis=2)
        normals /= np.linalg.norm(normals, axis=2, keepdims=True)
        texels: U8 = np.rint(127.5 + 127.5 * normals).astype(np.uint8)
        return texels


def median_size(quads: Quads, camera: Camera) -> F64 | None:
    """[2] median length of visible rectangles along u and v, px of a 1000 x 750 picture; None if none is."""
    along = np.linalg.norm(quads.corners[:, 1] - quads.corners[:, 0], axis=1)
    across = np.linalg.norm(quads.corners[:, 3] - quads.corners[:, 0], axis=1)
    depths = (quads.corners.mean(axis=1) - camera.position) @ camera.viewmat[2, :3]
    is_seen = depths > camera.near
    if not is_seen.any():
        return None
    scale = camera.K[0, 0] / depths[is_seen] / canvas_scale(camera.width, camera.height)
    sizes = np.stack([along[is_seen] * scale, across[is_seen] * scale], axis=1)
    return np.asarray(np.maximum(np.median(sizes, axis=0), 1.0))
