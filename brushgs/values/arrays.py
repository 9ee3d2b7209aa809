"""Array types, `smoothstep`, weights of a blur, and a check of shapes by letter: equal letters must agree."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]  # float32 or float64
F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
U8 = NDArray[np.uint8]
U32 = NDArray[np.uint32]
Mask = NDArray[np.bool_]
Rows = NDArray[np.intp]  # indices


def smoothstep(x: Array) -> F64:
    """3 x^2 - 2 x^3, clamped: 0 for x <= 0, 1 for x >= 1, zero slope at both ends. Same shape as x."""
    x = np.clip(x, 0, 1)
    return np.asarray(x * x * (3 - 2 * x))


def gaussian_weights(count: int, sigma: float, least: float = 1e-40) -> F64:
    """[count, count] weights of the cells of a line at each other in a Gaussian blur, 1 on the diagonal.

    Args:
        count: number of cells, >= 1.
        sigma: standard deviation, cells, > 0.
        least: smaller weights are 0: products of subnormal numbers take up to twenty times as long.
    """
    steps = np.arange(count)
    weights = np.exp(-0.5 * ((steps[:, None] - steps) / sigma) ** 2)
    return np.where(weights < least, 0.0, weights)


def check(where: str, **arrays: tuple[NDArray[Any], str]) -> dict[str, int]:
    """Check the shapes of named arrays against specifications such as "M 3".

    Args:
        where: name of the calling function or class; the error message starts with it.
        **arrays: name -> (array, specification). A specification lists dimensions, separated by spaces; a
            number must match exactly, a letter must have the same size wherever it occurs.

    Returns:
        The size of each letter.

    Raises:
        TypeError: if an argument is not a NumPy array.
        ValueError: if a shape does not match, in one sentence with the expected and the actual shape.
    """
    sizes: dict[str, int] = {}
    for name, (array, specification) in arrays.items():
        if not isinstance(array, np.ndarray):
            raise TypeError(f"{where}: {name} must be a NumPy array, got {type(array).__name__}")
        letters = specification.split()
        is_match = array.ndim == len(letters)
        for letter, size in zip(letters, array.shape, strict=False):
            expected = int(letter) if letter.isdigit() else sizes.setdefault(letter, size)
            is_match = is_match and expected == size
        if not is_match:
            wanted_shape = ", ".join(
                f"{d}={sizes[d]}" if d in sizes and not d.isdigit() else d for d in letters
            )
            raise ValueError(f"{where}: {name} must have shape [{wanted_shape}], got {list(array.shape)}")
    return sizes
