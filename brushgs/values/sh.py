"""Real spherical harmonics in the order and signs of 3D Gaussian Splatting.

A color seen from unit direction d (from the camera to the Gaussian, world frame) is max(0, 0.5 + sum over
terms of coefficient x basis(d)). Terms are sorted by degree l, then order m from -l to l.
Source: Kerbl et al. 2023; Sloan 2008, Stupid Spherical Harmonics Tricks, appendix A2 (with the
Condon-Shortley sign).
"""

from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike

from brushgs.values.arrays import F64, Array
from brushgs.values.gaussians import Gaussians

C0 = 0.28209479177387814  # 1 / (2 sqrt(pi)): the view-independent basis function

_ROWS_AT_A_TIME = 4096  # a used band usually shows within the first rows

_used_degrees: WeakKeyDictionary[Gaussians, int] = WeakKeyDictionary()


def sh_basis(directions: Array, degree: int) -> F64:
    """The (degree + 1)^2 basis functions, evaluated in given directions.

    Args:
        directions: [M, 3] unit vectors.
        degree: 0 to 3.

    Returns:
        [M, (degree + 1)^2] float64.
    """
    x, y, z = np.asarray(directions, dtype=np.float64).T
    pi = np.pi
    terms = [
        np.full_like(x, np.sqrt(1 / (4 * pi))),
        -np.sqrt(3 / (4 * pi)) * y,
        np.sqrt(3 / (4 * pi)) * z,
        -np.sqrt(3 / (4 * pi)) * x,
        np.sqrt(15 / (4 * pi)) * x * y,
        -np.sqrt(15 / (4 * pi)) * y * z,
        np.sqrt(5 / (16 * pi)) * (2 * z * z - x * x - y * y),
        -np.sqrt(15 / (4 * pi)) * x * z,
        np.sqrt(15 / (16 * pi)) * (x * x - y * y),
        -np.sqrt(35 / (32 * pi)) * y * (3 * x * x - y * y),
        np.sqrt(105 / (4 * pi)) * x * y * z,
        -np.sqrt(21 / (32 * pi)) * y * (4 * z * z - x * x - y * y),
        np.sqrt(7 / (16 * pi)) * z * (2 * z * z - 3 * x * x - 3 * y * y),
        -np.sqrt(21 / (32 * pi)) * x * (4 * z * z - x * x - y * y),
        np.sqrt(105 / (16 * pi)) * z * (x * x - y * y),
        -np.sqrt(35 / (32 * pi)) * x * (x * x - 3 * y * y),
    ]
    return np.stack(terms[: (degree + 1) ** 2], axis=1)


def sh_rotation(matrix: Array, degree: int) -> F64:
    """Matrix that transforms coefficients when a scene is rotated or mirrored.

    A rotated Gaussian has in direction R d the color that it had in d. Each degree is closed under rotation,
    so its matrix follows from the basis functions in a few directions.

    Args:
        matrix: [3, 3] orthogonal R; its determinant may be -1.
        degree: 0 to 3.

    Returns:
        [k, k] float64, k = (degree + 1)^2, block-diagonal: new = matrix @ old coefficients.
    """
    num_terms = (degree + 1) ** 2
    # Directions spread over the sphere (a Fibonacci lattice): twice as many as the largest band has terms.
    count = np.arange(2 * 7) + 0.5
    z, turn = 1 - 2 * count / len(count), count * np.pi * (3 - np.sqrt(5))
    radius = np.sqrt(1 - z * z)
    directions = np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1)
    after = sh_basis(directions, degree)
    before = sh_basis(directions @ np.asarray(matrix, dtype=np.float64), degree)  # R^-1 d, row by row
    found = np.zeros((num_terms, num_terms))
    for band in range(degree + 1):
        terms = slice(band**2, (band + 1) ** 2)
        found[terms, terms] = np.linalg.lstsq(after[:, terms], before[:, terms], rcond=None)[0]
    return found


def base_colors(sh: Array) -> F64:
    """The color without its view-dependent part, clipped to the display range: clamp(0.5 + C0 sh_0, 0, 1).

    Args:
        sh: [N, k, 3] coefficients, k >= 1.

    Returns:
        [N, 3] RGB, display-encoded, float64.
    """
    return np.asarray(np.clip(0.5 + C0 * sh[:, 0].astype(np.float64), 0.0, 1.0))


def shift_base_colors(gaussians: Gaussians, steps: Array) -> Gaussians:
    """Shift the base colors of Gaussians; view dependence stays.

    Args:
        gaussians: N Gaussians.
        steps: [N, 3] added to RGB. Base colors within 0 to 1 are clamped to it; those outside do not move
            further out.
    """
    before = 0.5 + C0 * gaussians.sh[:, 0].astype(np.float64)
    after = np.clip(before + steps, np.minimum(before, 0.0), np.maximum(before, 1.0))
    sh = gaussians.sh.copy()
    sh[:, 0] = (after - 0.5) / C0
    return replace(gaussians, sh=sh)


def in_colors(gaussians: Gaussians, colors: ArrayLike) -> Gaussians:
    """The Gaussians in given, view-independent colors (SH degree 0).

    Args:
        gaussians: N Gaussians.
        colors: [N, 3] or [3] RGB, display-encoded.
    """
    sh = np.empty((len(gaussians), 1, 3), gaussians.sh.dtype)
    sh[:, 0] = (np.asarray(colors, np.float64) - 0.5) / C0
    return replace(gaussians, sh=sh)


def seen_from(gaussians: Gaussians, eye: ArrayLike) -> Gaussians:
    """Gaussians in the colors that a viewer sees, from wherever they are looked at (SH degree 0).

    A fifth of the bytes of a scene with highlights that move.

    Args:
        gaussians: N Gaussians.
        eye: [3] position of the viewer, world units.
    """
    away = gaussians.means - np.asarray(eye, np.float64)
    directions = away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-12)
    colors = np.einsum("nk,nkc->nc", sh_basis(directions, gaussians.sh_degree), gaussians.sh, optimize=True)
    return replace(gaussians, sh=np.maximum(colors / C0, -0.5 / C0)[:, None].astype(gaussians.sh.dtype))


def used_sh_degree(gaussians: Gaussians) -> int:
    """The highest SH degree with a non-zero coefficient, 0 to 3: higher degrees cannot change a color.

    Cached per scene. Reading stops at the first row that uses the highest stored degree.
    """
    known = _used_degrees.get(gaussians)
    if known is None:
        known = _used_degrees[gaussians] = _find_used_degree(gaussians)
    return known


def _find_used_degree(gaussians: Gaussians) -> int:
    used = 0
    for start in range(0, len(gaussians), _ROWS_AT_A_TIME):
        rows = gaussians.sh[start : start + _ROWS_AT_A_TIME]
        for degree in range(gaussians.sh_degree, used, -1):
            if rows[:, degree**2 : (degree + 1) ** 2].any():
                used = degree
                break
        if used == gaussians.sh_degree:
            break
    return used
