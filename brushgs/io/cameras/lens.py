"""What all camera formats check of a lens: a pinhole of usable numbers, without distortion."""

import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from brushgs.errors import SceneWarning
from brushgs.options.choices import size_rule

# Pixels and world units far beyond any camera: squares and quotients of larger numbers overflow.
FOCAL_LENGTHS, MAX_DISTANCE = (1e-3, 1e9), 1e15


def lens_rule(K: Sequence[float], size: Sequence[float], place: ArrayLike) -> str | None:
    """The rule that an unusable camera breaks, in words; None for a usable one.

    Args:
        K: fx, fy, cx, cy, pixels.
        size: width and height, pixels.
        place: its position or translation, world units.
    """
    if max(size) > 1 << 20:  # first: it may have hundreds of digits, and others follow from it
        return f"the size must be that of a picture, got more than {1 << 20} pixels along a side"
    least, most = FOCAL_LENGTHS
    if not all(least <= focal <= most for focal in K[:2]):
        return f"the focal length must be {least:g} to {most:g} pixels, got {min(K[:2]):g} and {max(K[:2]):g}"
    if not all(abs(value) <= most for value in K[2:]):
        return f"the principal point must lie within {most:g} pixels, got {K[2]:g}, {K[3]:g}"
    if not (farthest := np.abs(place).max()) <= MAX_DISTANCE:
        return f"the position must lie within {MAX_DISTANCE:g} of the origin, got {farthest:g}"
    broken = size_rule(max(1, round(size[0])), max(1, round(size[1])))
    return f"the size {broken}" if broken else None


def warn_of_distortion(path: Path, model: str, coefficients: dict[str, float]) -> None:
    """Warn once that the lens distortion of a file is ignored; `coefficients` are those above or below 0."""
    listed = ", ".join(f"{name} = {value:g}" for name, value in coefficients.items())
    message = f"the distortion of camera model {model} was ignored ({listed}); pictures are a pinhole's"
    warnings.warn(SceneWarning(f"{path}: {message}"), stacklevel=4)
