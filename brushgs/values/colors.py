"""RGB: colors by name, luminance, the sRGB transfer function to linear light and back, and OKLab.

Scenes are trained and blended display-encoded; only files in linear light (EXR, HDR) and color comparisons
need the transfer function. Values above 1 follow the same formula, negative ones are mirrored. OKLab is
perceptually uniform and used for color shifts; black is 0, white (1, 0, 0).
Sources: ITU-R BT.709 (luminance), IEC 61966-2-1 (sRGB); Ottosson 2020, A perceptual color space for image
processing.
"""

import numpy as np
from numpy.typing import ArrayLike

from brushgs.options.choices import COLORS, color_code
from brushgs.values.arrays import F64, Array

LUMINANCE = (0.2126, 0.7152, 0.0722)  # weights of red, green and blue
CONES_FROM_RGB = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
OKLAB_FROM_ROOTS = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)
OKLAB = CONES_FROM_RGB, OKLAB_FROM_ROOTS


def rgb_of(color: str) -> tuple[float, float, float]:
    """Display-encoded RGB, 0 to 1, of a name in `COLORS` or "#rrggbb".

    Raises:
        ValueError: if it is neither.
    """
    code = color_code(color)
    if code is None:
        raise ValueError(f"a color must be '#rrggbb' or one of {', '.join(COLORS)}, got {color!r}")
    red, green, blue = (int(code[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return red, green, blue


def code_of(rgb: ArrayLike) -> str:
    """A display-encoded color [3] as "#rrggbb"; values are clipped to 0 to 1."""
    return "#" + "".join(f"{round(255 * float(channel)):02x}" for channel in np.clip(rgb, 0, 1))


def linear_from_srgb(encoded: Array) -> Array:
    """Linear light of display-encoded values, any shape."""
    size = np.abs(encoded)
    linear = np.where(size <= 0.04045, size / 12.92, ((size + 0.055) / 1.055) ** 2.4)
    return np.asarray(np.copysign(linear, encoded), dtype=encoded.dtype)


def srgb_from_linear(linear: Array) -> Array:
    """Display-encoded values of linear light, any shape."""
    size = np.abs(linear)
    encoded = np.where(size <= 0.0031308, size * 12.92, 1.055 * size ** (1 / 2.4) - 0.055)
    return np.asarray(np.copysign(encoded, linear), dtype=linear.dtype)


def srgb_slope(encoded: Array) -> Array:
    """Derivative of `linear_from_srgb`, any shape: 1/12.92 and above."""
    size = np.abs(encoded)
    slope = np.where(size <= 0.04045, 1 / 12.92, 2.4 / 1.055 * ((size + 0.055) / 1.055) ** 1.4)
    return np.asarray(slope, dtype=encoded.dtype)


def oklab_of(rgb: F64) -> F64:
    """OKLab of display-encoded colors [N, 3]: lightness 0 to 1, green to red, blue to yellow."""
    return np.asarray(np.cbrt(linear_from_srgb(rgb) @ CONES_FROM_RGB.T) @ OKLAB_FROM_ROOTS.T)


def rgb_of_oklab(lab: F64) -> F64:
    """Display-encoded colors [N, 3] of OKLab, also out of gamut: the inverse of `oklab_of`."""
    linear = (lab @ np.linalg.inv(OKLAB_FROM_ROOTS).T) ** 3 @ np.linalg.inv(CONES_FROM_RGB).T
    return np.asarray(srgb_from_linear(linear))


def split_alpha(pixels: Array) -> tuple[Array, Array | None]:
    """RGB and alpha of pixels as `read_image` returns them.

    Args:
        pixels: [..., C] grey, grey and alpha, RGB, or RGB and alpha.

    Returns:
        RGB [..., 3] (grey repeated), and alpha [...] or None.
    """
    channels = pixels.shape[-1]
    rgb = pixels[..., :3] if channels >= 3 else np.repeat(pixels[..., :1], 3, axis=-1)
    return rgb, pixels[..., -1] if channels in (2, 4) else None


def flatten(pixels: Array, background: float | Array = 1.0) -> Array:
    """Composite pixels [..., C] with straight alpha over white, a grey or an RGB color [3]: RGB [..., 3]."""
    rgb, alpha = split_alpha(pixels)
    if alpha is None:
        return rgb
    return np.asarray(rgb * alpha[..., None] + (1 - alpha[..., None]) * background)
