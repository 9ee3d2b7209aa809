"""A picture in another size."""

from typing import Literal

import numpy as np

from brushgs.values.arrays import Array, check

Edges = Literal["mirror", "nearest"]  # what lies beyond a picture, as SciPy calls it


def resize(picture: Array, width: int, height: int, *, edges: Edges = "mirror") -> Array:
    """Interpolate between the four nearest pixels, after smoothing a side that becomes smaller.

    A side that becomes smaller by a factor f is smoothed by a Gaussian of (f - 1) / 2 pixels. The numbers are
    those of scikit-image's `transform.resize`, which is made of the same functions of SciPy, bit for bit.

    Args:
        picture: [H, W, C] finite, H, W and C >= 1.
        width: pixels, >= 1.
        height: pixels, >= 1.
        edges: "mirror": the picture reflected about its outermost pixels; "nearest": these pixels again.

    Returns:
        [height, width, C] in the dtype and within the range of the picture.

    Raises:
        ValueError: if the shape is not [H, W, C].
    """
    from scipy.ndimage import gaussian_filter, zoom

    sizes = check("resize", picture=(picture, "H W C"))
    factors = np.divide(picture.shape, (height, width, sizes["C"]))
    smooth = gaussian_filter(picture, np.maximum(0, (factors - 1) / 2), mode=edges)
    resized: Array = zoom(smooth, [1 / factor for factor in factors], order=1, mode=edges, grid_mode=True)
    return np.clip(resized, picture.min(), picture.max(), out=resized)
