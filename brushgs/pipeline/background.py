"""The background of a picture: a named color, "#rrggbb" or an image file becomes a color or an array."""

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from brushgs.formats.files import is_plain
from brushgs.formats.pictures.images import resize
from brushgs.options.choices import COLORS, color_code
from brushgs.values.colors import flatten, rgb_of
from brushgs.values.part import Part

TRANSPARENT = "transparent"  # no background
_ROWS = 64
_FAR = 8  # times the picture: above this, block means look the same as antialiased scaling
Background = tuple[float, float, float] | NDArray[np.float32] | None


def check_background(text: str) -> None:
    """Refuse a background that `open_background` could not use, before any work.

    Raises:
        ValueError: if the text is neither a known name, a color nor an existing file.
    """
    is_color = text.lower() == TRANSPARENT or color_code(text) is not None
    if not is_color and not is_plain(Path(text)):
        names = ", ".join(COLORS)
        raise ValueError(f"background must be {names}, transparent, #rrggbb or an image file, got {text!r}")


def open_background(text: str, width: int, height: int) -> Background:
    """Open the background of a picture.

    Args:
        text: the name of a color (`COLORS`), "transparent", "#rrggbb", or an image file.
        width: of the picture, pixels.
        height: of the picture, pixels.

    Returns:
        None for transparent, one RGB color 0 to 1, or float32 [height, width, 3]: the image scaled to fill
        the picture and cropped evenly to its center, on white if transparent.

    Raises:
        ValueError: if the text is no background.
        SceneError: if the image cannot be read.
    """
    check_background(text)
    if text.lower() == TRANSPARENT:
        return None
    if text.lower() in COLORS or (color_code(text) is not None and not is_plain(Path(text))):
        return rgb_of(text)
    from brushgs.formats.pictures.images import read_image

    return fill_picture(_flatten_rows(read_image(text)), width, height)


def cut_background(background: Background, part: Part | None) -> Background:
    """The background of a part of the picture; None for all of it."""
    if part is None or not isinstance(background, np.ndarray) or background.ndim == 1:
        return background
    return background[part.rows, part.columns]


def _crop(image: NDArray[np.float32], width: int, height: int) -> NDArray[np.float32]:
    """Crop most of what lies outside the picture: one line of pixels would become very long when scaled."""
    rows, columns = image.shape[:2]
    factor = max(width / columns, height / rows)
    for axis, (have, side) in enumerate(((rows, height), (columns, width))):
        # Twice the visible part: its center stays the same, and smoothing at its ends does not reach it.
        keep = min(have, 2 * math.ceil(side / factor) + 2 + have % 2)
        start = (have - keep) // 2
        image = np.take(image, range(start, start + keep), axis) if keep < have else image
    return image


def _shrink_blocks(image: NDArray[np.float32], width: int, height: int) -> NDArray[np.float32]:
    """Average whole blocks where the image is far larger than the picture: smoothing would take minutes."""
    step = min(image.shape[0] // (_FAR * height), image.shape[1] // (_FAR * width))
    if step < 2:
        return image
    rows, columns = (side // step for side in image.shape[:2])
    blocks = image[: rows * step, : columns * step].reshape(rows, step, columns, step, -1)
    return np.asarray(blocks.mean(axis=(1, 3), dtype=np.float32))


def _flatten_rows(image: NDArray[np.float32]) -> NDArray[np.float32]:
    """`flatten` a few rows at a time: whole copies of a large image add up."""
    flat = np.empty((*image.shape[:2], 3), np.float32)
    for start in range(0, len(image), _ROWS):
        flat[start : start + _ROWS] = flatten(image[start : start + _ROWS])
    return flat


def fill_picture(image: NDArray[np.float32], width: int, height: int) -> NDArray[np.float32]:
    """Scale to cover width x height, antialiased where it shrinks, and crop to the center."""
    rows, columns = image.shape[:2]
    if (rows, columns) != (height, width):
        image = _shrink_blocks(_crop(image, width, height), width, height)
        rows, columns = image.shape[:2]
        factor = max(width / columns, height / rows)
        image = resize(image, max(width, round(columns * factor)), max(height, round(rows * factor)))
    top, left = (image.shape[0] - height) // 2, (image.shape[1] - width) // 2
    return np.ascontiguousarray(image[top : top + height, left : left + width])
