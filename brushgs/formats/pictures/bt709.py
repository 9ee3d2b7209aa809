"""RGB becomes the planes of luma and chroma that video codecs take, by BT.709 in limited range.

libav's scaler does this for pixels of 8 bits. For more it rounds up: luma came out one or two levels of ten
bits too bright, and alpha one too opaque. Here every sample is within half a level.

Source: ITU-R BT.709-6, items 3.2 to 3.5.
"""

import numpy as np

from brushgs.formats.pictures.pixels import Pixels
from brushgs.values.arrays import F32

_RED, _GREEN, _BLUE = 0.2126, 0.7152, 0.0722
_FROM_RGB = np.array(
    [
        (_RED, _GREEN, _BLUE),
        (-_RED / 1.8556, -_GREEN / 1.8556, (1 - _BLUE) / 1.8556),
        ((1 - _RED) / 1.5748, -_GREEN / 1.5748, -_BLUE / 1.5748),
    ],
    np.float32,
)


def planes_of(pixels: Pixels, bits: int, *, halves_chroma: bool) -> list[Pixels]:
    """Luma, two planes of chroma, and alpha where there is one.

    Args:
        pixels: [H, W, 3 or 4] over the full range of their type.
        bits: of a sample, 9 to 16; as limited range: 10 bits of luma are 64 to 940. Alpha has the full range.
        halves_chroma: whether chroma has a sample for each 2 x 2 pixels, their mean; sides must be even then.
    """
    values = pixels * np.float32(1 / np.iinfo(pixels.dtype).max)
    luma, *chroma = np.moveaxis(values[..., :3] @ _FROM_RGB.T, -1, 0)
    level = 1 << bits - 8
    planes = [_rounded((16 + 219 * luma) * level)]
    for part in chroma:
        if halves_chroma:
            part = (part[0::2, 0::2] + part[0::2, 1::2] + part[1::2, 0::2] + part[1::2, 1::2]) / 4
        planes.append(_rounded((128 + 224 * part) * level))
    if values.shape[2] == 4:
        planes.append(_rounded(values[..., 3] * ((1 << bits) - 1)))
    return planes


def _rounded(samples: F32) -> Pixels:
    return np.asarray(samples + np.float32(0.5)).astype(np.uint16)
