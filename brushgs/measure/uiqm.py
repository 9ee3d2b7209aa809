"""UIQM: colorfulness, sharpness and contrast of a picture, without a truth."""

import numpy as np

from brushgs.values.arrays import F64, Array, check

COLOR, SHARPNESS, CONTRAST = 0.0282, 0.2953, 3.5753  # weights of the three parts
TRIMMED = 0.1  # share of the smallest and of the largest values that the mean of a color channel ignores
BLOCK = 10  # pixels, side of the blocks for contrast; figures depend on it
LUMA = 0.299, 0.587, 0.114  # weights of the sharpness of R, G, B


def uiqm(picture: Array) -> float:
    """0.0282 UICM + 0.2953 UISM + 3.5753 UIConM of a picture; higher is livelier, a flat picture has 0.

    With values 0 to 255:
    - UICM = -0.0268 sqrt(m_rg^2 + m_yb^2) + 0.1586 sqrt(v_rg + v_yb) of rg = R - G and yb = (R + G) / 2 - B:
      m the mean without a tenth of the values at either end, v the mean squared distance from it;
    - UISM = sum of 0.299, 0.587, 0.114 times the EME of each channel times its Sobel magnitude: the mean
      over blocks of 10 x 10 pixels of 2 ln(greatest / least), 0 in blocks whose least value is 0;
    - UIConM = mean over such blocks of -q ln q, with q = (greatest - least) / (greatest + least) over all
      pixels and channels, 0 where that is undefined. Sums and differences are plain, not those of PLIP.

    Implementations differ in these and in blocks: compare figures of this function only with each other.
    Source: Panetta, Gao and Agaian 2016, Human-Visual-System-Inspired Underwater Image Quality Measures.

    Args:
        picture: [H, W, 3] display-encoded, 0 to 1, both sides at least 10 pixels; incomplete blocks at the
            right and the bottom are ignored in UISM and UIConM.

    Raises:
        ValueError: if a shape does not fit.
    """
    sizes = check("uiqm", picture=(picture, "H W 3"))
    if min(sizes["H"], sizes["W"]) < BLOCK:
        raise ValueError(f"uiqm: both sides must be at least {BLOCK} pixels, got {sizes['W']}x{sizes['H']}")
    values = 255.0 * np.clip(np.asarray(picture, np.float64), 0, 1)
    return COLOR * colorfulness(values) + SHARPNESS * sharpness(values) + CONTRAST * contrast(values)


def colorfulness(values: F64) -> float:
    """UICM of [H, W, 3], 0 to 255."""
    red, green, blue = np.moveaxis(values, -1, 0)
    (mean_rg, spread_rg), (mean_yb, spread_yb) = map(_trimmed, (red - green, 0.5 * (red + green) - blue))
    return float(-0.0268 * np.hypot(mean_rg, mean_yb) + 0.1586 * np.sqrt(spread_rg + spread_yb))


def sharpness(values: F64) -> float:
    """UISM of [H, W, 3], 0 to 255."""
    from scipy.ndimage import sobel

    total = 0.0
    for weight, channel in zip(LUMA, np.moveaxis(values, -1, 0), strict=True):
        edges = np.hypot(sobel(channel, axis=0), sobel(channel, axis=1)) * channel
        blocks = _blocks(edges)
        least, greatest = blocks.min(axis=(1, 3)), blocks.max(axis=(1, 3))
        # Rounding leaves edges of 1e-13 in flat areas.
        is_positive = least > 1e-6
        ratios = np.divide(greatest, least, out=np.ones_like(least), where=is_positive)
        total += weight * float(2 * np.log(ratios).mean())
    return total


def contrast(values: F64) -> float:
    """UIConM of [H, W, 3], 0 to 255."""
    blocks = _blocks(values)
    least, greatest = blocks.min(axis=(1, 3, 4)), blocks.max(axis=(1, 3, 4))
    has_contrast = greatest > least
    q = np.divide(greatest - least, greatest + least, out=np.ones_like(least), where=has_contrast)
    return float((-q * np.log(q)).mean())


def _trimmed(values: F64) -> tuple[float, float]:
    """The mean without both ends, and the mean squared distance of all values from it."""
    ordered = np.sort(values, axis=None)
    cut = int(TRIMMED * len(ordered))
    mean = float(ordered[cut : len(ordered) - cut].mean())
    return mean, float(((ordered - mean) ** 2).mean())


def _blocks(values: F64) -> F64:
    """[rows, BLOCK, columns, BLOCK, ...] of [H, W, ...]."""
    rows, columns = values.shape[0] // BLOCK, values.shape[1] // BLOCK
    whole = values[: rows * BLOCK, : columns * BLOCK]
    return whole.reshape(rows, BLOCK, columns, BLOCK, *values.shape[2:])
