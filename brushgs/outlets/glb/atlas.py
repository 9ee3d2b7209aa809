"""Pack all brushes into one texture: white, with the coverage as alpha.

Colored brushes have colors that viewers multiply by the color of a stroke. The renderer adds instead; both
agree if a stroke has the mean color of its brush.

There is one texture and one material, since overlapping strokes have different brushes, and viewers that draw
a mesh in index order keep the order of strokes only within one material.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.brush_set import BrushSet
from brushgs.brushes.soft import soft_brush
from brushgs.brushes.texture import TINT_ZERO, StrokeTexture
from brushgs.values.arrays import F64, U8
from brushgs.values.colors import linear_from_srgb, srgb_from_linear

# Transparent texels between brushes, and grid of their positions: the first four mip levels do not mix
# brushes.
GAP = 16
DARK = 0.06  # display-encoded: least mean of a brush, as ratios to a darker one would be too large
BRIGHT = 0.98  # quantile of the texels that is not clipped
MOST_GAIN = 3.0  # limit of the gain of strokes
KERNEL_TEXELS = 256  # side of a kernel as an image


@dataclass(frozen=True, eq=False)
class Atlas:
    """Several brushes in one image.

    Attributes:
        pixels: [h, w, 4] color and coverage of all brushes, white and 0 between them; sides are powers
            of two.
        places: [B, 4] texture coordinates of the centers of the first (u, v) and the last texel of each
            brush; v runs downward. These are the corners of its box, as in the renderer.
    """

    pixels: U8
    places: F64

    @classmethod
    def of(cls, images: Sequence[U8]) -> "Atlas":
        """Pack images, [h, w] coverage or [h, w, 4], at least one, in rows, the highest first.

        The width is the power of two that needs the fewest texels; of equal ones, the most nearly square.
        """
        cells = np.array([[-(-(side + GAP) // GAP) * GAP for side in image.shape[1::-1]] for image in images])
        least = _power_of_two(GAP + int(cells[:, 0].max()))
        most = max(least, _power_of_two(GAP + int(cells[:, 0].sum())))
        widths = [least << step for step in range((most // least).bit_length())]
        made = [(width, *_rows_of(cells, width)) for width in widths]
        width, corners, height = min(made, key=lambda one: (one[0] * one[2], max(one[0], one[2])))
        pixels, places = np.full((height, width, 4), 255, np.uint8), np.empty((len(images), 4))
        pixels[..., 3] = 0
        for row, (image, (x, y)) in enumerate(zip(images, corners, strict=True)):
            h, w = image.shape[:2]
            pixels[y : y + h, x : x + w] = _white(image) if image.ndim == 2 else image
            places[row] = x + 0.5, y + 0.5, x + w - 0.5, y + h - 0.5
        return cls(pixels, places / (width, height, width, height))

    @property
    def coverage(self) -> U8:
        """[h, w] coverage of all brushes."""
        return self.pixels[..., 3]

    def beside(self, images: Sequence[U8 | None], fill: tuple[int, ...]) -> U8:
        """[h, w, 3] other images of the brushes in the same layout; None for brushes without one."""
        height, width = self.coverage.shape
        pixels = np.full((height, width, 3), fill, np.uint8)
        for image, place in zip(images, self.places, strict=True):
            if image is not None:
                x, y = np.rint(place[:2] * (width, height) - 0.5).astype(int)
                pixels[y : y + image.shape[0], x : x + image.shape[1]] = image
        return pixels

    def png(self) -> bytes:
        """The texture as an 8-bit PNG: white between brushes, so that no filter darkens an edge.

        Raises:
            SceneError: if the folder for temporary files is full.
        """
        return png_of(self.pixels)


def png_of(pixels: U8) -> bytes:
    """Pixels [h, w, 3 or 4] as an 8-bit PNG; see `Atlas.png`."""
    from brushgs.formats.pictures.oiio import encode_pixels

    attributes = {"oiio:UnassociatedAlpha": 1, "png:compressionLevel": 6}  # 9: 6 % less, 9 times as long
    return encode_pixels("png", pixels, attributes)


def images_of(brushes: BrushSet) -> list[tuple[U8, float]]:
    """Each brush (or kernel) as an image [h, w, 4] and a gain; last the soft kernel of underpaint.

    The gain, in linear light, must be applied to the colors of the strokes, as a texture can only darken.
    """
    soft = soft_brush().coverage
    return [*(_image_of(texture, soft) for texture in brushes.textures), (_white(soft), 1.0)]


def _image_of(texture: StrokeTexture, soft: U8) -> tuple[U8, float]:
    if texture.kind != "image":
        return _white(soft if texture.kind == "gaussian" else _disc()), 1.0
    image, tint = _white(texture.coverage), texture.tint
    if tint is None or tint.step == 0:
        return image, 1.0
    away = (tint.texels.astype(np.float64) - TINT_ZERO) * tint.step
    mean = np.maximum(tint.mean, DARK)
    factors = linear_from_srgb(np.clip(mean + away, 0, 1)) / linear_from_srgb(mean)
    gain = float(np.clip(np.quantile(factors[texture.coverage > 0], BRIGHT), 1, MOST_GAIN))
    image[..., :3] = np.rint(255 * srgb_from_linear(np.clip(factors / gain, 0, 1)))
    return image, gain


def _white(coverage: U8) -> U8:
    image = np.full((*coverage.shape, 4), 255, np.uint8)
    image[..., 3] = coverage
    return image


def _disc() -> NDArray[np.uint8]:
    """The kernel "ellipse": full inside the circle inscribed in its box, with an edge of one texel."""
    s = np.linspace(-1, 1, KERNEL_TEXELS)
    inside = (1 - np.hypot(s[:, None], s)) * (KERNEL_TEXELS - 1) / 2  # distance from the edge, texels
    return np.rint(255 * np.clip(inside + 0.5, 0, 1)).astype(np.uint8)


def _rows_of(cells: NDArray[np.int64], width: int) -> tuple[list[tuple[int, int]], int]:
    """Positions of cells [B, 2] (width, height) in rows of a given width, and the total height."""
    corners = [(0, 0)] * len(cells)
    x, y, row_height = GAP, GAP, 0
    for index in np.lexsort((-cells[:, 0], -cells[:, 1])):
        w, h = map(int, cells[index])
        if x + w > width:
            x, y, row_height = GAP, y + row_height, 0
        corners[index] = x, y
        x, row_height = x + w, max(row_height, h)
    return corners, _power_of_two(y + row_height)


def _power_of_two(value: int) -> int:
    return 1 << (value - 1).bit_length()
