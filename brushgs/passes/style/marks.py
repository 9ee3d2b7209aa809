"""Learn the marks of a painting: direction, length, width, color variation, and images.

Everything is measured in the picture alone, in a second or two: directions by the structure tensor
(`mark_directions`), sizes by how fast colors change along and across marks (`sizes`), the ground if there is
evidence of it (`ground`), images of single marks (`cut`), and marks with their colors (`dictionary`). The
relief stays 0, unknown: light on ridges cannot be told from painted light. The skewness of slopes, which lit
ridges have, differs by 0.2 to 1 between relief 0 and 1 of a scene, and by 1 and more from scene to scene.
"""

import numpy as np

from brushgs.passes.color.broken_color import MOST
from brushgs.passes.color.color_space import oklab_planes
from brushgs.passes.form.mark_directions import marks_in
from brushgs.passes.style.averages import averaged
from brushgs.passes.style.cut import cut_marks
from brushgs.passes.style.dictionary import MANY, cut_dictionary
from brushgs.passes.style.ground import find_ground
from brushgs.passes.style.sizes import mark_sizes
from brushgs.values.arrays import F32, F64, Array
from brushgs.values.style import StyleMarks

MOST_GRID = 48  # directions along the longer side of a painting
FINEST_SIDE = 2048  # pixels, for cutting out marks; larger paintings are averaged
MOST_SIDE = 1024  # pixels, for measuring marks; larger paintings are averaged
LEAST_SIDE = 32  # pixels


def learn_marks(image: Array, num_marks: int = MANY) -> StyleMarks:
    """Learn the marks of a painting.

    Args:
        image: [H, W, C] as `read_image` returns it: 1 to 4 channels, 0 to 1, display-encoded. Transparent
            areas count as white, without directions.
        num_marks: largest number in its dictionary; 0 for none.

    Raises:
        TypeError: if `image` is not an array.
        ValueError: if it has other channels, is smaller than 32 x 32 pixels, or shows no marks.
    """
    pairs = marks_in("learn_marks", image, LEAST_SIDE)
    rgb = averaged(image, MOST_SIDE)
    measured = mark_sizes(oklab_planes(rgb))
    return StyleMarks(
        length=measured.length,
        aspect=measured.aspect,
        directions=_grid(pairs),
        broken_lightness=min(measured.lightness, MOST),
        broken_chroma=min(measured.chroma, MOST),
        ground=find_ground(rgb),
        brushes=cut_marks(rgb, measured),
        coherent=measured.coherent,
        incoherent=measured.incoherent,
        dictionary=cut_dictionary(averaged(image, FINEST_SIDE), measured, num_marks) if num_marks else None,
    )


def _grid(pairs: F64) -> F32:
    """Mean directions in the cells of a small grid of the same aspect."""
    height, width = pairs.shape[:2]
    scale = min(1.0, MOST_GRID / max(height, width))
    rows, columns = max(1, round(height * scale)), max(1, round(width * scale))
    starts = [np.arange(n) * size // n for n, size in ((rows, height), (columns, width))]
    sums = np.add.reduceat(np.add.reduceat(pairs, starts[0], axis=0), starts[1], axis=1)
    counts = np.outer(*(np.diff([*first, size]) for first, size in zip(starts, (height, width), strict=True)))
    return (sums / counts[..., None]).astype(np.float32)
