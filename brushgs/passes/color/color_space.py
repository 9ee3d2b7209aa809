"""Conversions between display-encoded RGB and the space in which colors are matched, and derivatives.

"srgb" is the encoded RGB itself, "linear" linear light, "lab" CIELAB (white D65), divided by 100 so that all
three have numbers of order one. Out-of-gamut colors, encoded values beyond 0 to 1, survive the round trip.
Source: IEC 61966-2-1 (sRGB); ISO/CIE 11664-4 (CIELAB). For OKLab, used for shifts, see
`brushgs.values.colors`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.options.choices import ColorSpace
from brushgs.values.arrays import F32, F64, Array
from brushgs.values.colors import (
    CONES_FROM_RGB,
    OKLAB_FROM_ROOTS,
    linear_from_srgb,
    srgb_from_linear,
    srgb_slope,
)

_XYZ_FROM_RGB = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
# XYZ over the white point, which is the sum of each row: a gray has three equal numbers.
XYZ_OVER_WHITE = _XYZ_FROM_RGB / _XYZ_FROM_RGB.sum(axis=1, keepdims=True)
_LAB_FROM_ROOTS = np.array([[0.0, 1.16, 0.0], [5.0, -5.0, 0.0], [0.0, 2.0, -2.0]])
_BLACK = np.array([-0.16, 0.0, 0.0])  # offset that makes the lightness of black 0
_DARKEST_ROOT = 6 / 29  # below, the cube root is replaced by its tangent
_HALVINGS = 10  # bisection steps between a color and a requested one


def in_gamut(colors: F64, asked: F64, rgb_of: Callable[[F64], F64]) -> F64:
    """Display-encoded colors in 0 to 1, as near to the requested ones as a display allows.

    Each moves from its color toward the requested one as far as possible, so that a saturated light stays
    saturated instead of turning white. If the requested color is darker, the start is its color in less
    light.

    Args:
        colors: [n, 3] in CIELAB or OKLab, in gamut, lightness first.
        asked: [n, 3] in the same space, also out of gamut.
        rgb_of: of colors of that space.
    """
    rgb = rgb_of(asked)
    beyond = np.flatnonzero(((rgb < -1e-9) | (rgb > 1 + 1e-9)).any(axis=1))
    own, goals = colors[beyond], asked[beyond]
    dimmed = np.clip(goals[:, :1] / np.maximum(own[:, :1], 1e-9), 0, 1)
    start, share = dimmed * own, np.zeros((len(beyond), 1))
    for n in range(1, _HALVINGS + 1):
        tried = rgb_of(start + (share + 0.5**n) * (goals - start))
        share += 0.5**n * ((tried >= 0) & (tried <= 1)).all(axis=1, keepdims=True)
    rgb[beyond] = rgb_of(start + share * (goals - start))
    return np.clip(rgb, 0, 1)


def oklab_planes(rgb: F32) -> F32:
    """OKLab [3, H, W] of a picture [H, W, 3], display-encoded, 0 to 1.

    Both nonlinearities are tables with errors up to 0.002. Values beyond 0 to 1 are clipped.
    """
    planes = np.empty((3, *rgb.shape[:2]), np.float32)
    _core.oklab_planes(
        tables=oklab_tables(),
        rgb=np.ascontiguousarray(rgb, np.float32),
        planes=planes,
        num_threads=num_threads_or_default(None),
    )
    return planes


@cache
def oklab_tables() -> tuple[F32, F32, F32, F32]:
    """The tables and matrices with which the core computes OKLab.

    Linear light by encoded value, and the cube root by the square root of its argument, both over 0 to 1; and
    the matrices [3, 3] before and after the roots.
    """
    steps = np.linspace(0, 1, 8192, dtype=np.float32)
    tables = linear_from_srgb(steps), np.cbrt(steps**2), CONES_FROM_RGB, OKLAB_FROM_ROOTS
    light, roots, cones, lab = (np.asarray(table, np.float32) for table in tables)
    return light, roots, cones, lab


@dataclass(frozen=True)
class Space:
    """A color space: matrix x nonlinearity(matrix x linear light), where each step may be the identity.

    Attributes:
        name: see the module.
    """

    name: ColorSpace

    def to(self, rgb: Array) -> F64:
        """Display-encoded colors [N, 3] in this space."""
        if self.name == "srgb":
            return np.asarray(rgb, np.float64)
        linear = linear_from_srgb(np.asarray(rgb, np.float64))
        if self.name == "linear":
            return np.asarray(linear, np.float64)
        return np.asarray(_root(linear @ XYZ_OVER_WHITE.T) @ _LAB_FROM_ROOTS.T + _BLACK)

    def back(self, colors: F64) -> F64:
        """Colors [N, 3] of this space, display-encoded: the inverse of `to`."""
        if self.name == "srgb":
            return colors
        if self.name == "linear":
            return np.asarray(srgb_from_linear(colors), np.float64)
        roots = (colors - _BLACK) @ np.linalg.inv(_LAB_FROM_ROOTS).T
        return np.asarray(srgb_from_linear(_cube(roots) @ np.linalg.inv(XYZ_OVER_WHITE).T), np.float64)

    def slopes_to(self, rgb: F64) -> F64:
        """[N, 3, 3] the derivative of `to` at display-encoded colors [N, 3]."""
        if self.name == "srgb":
            return np.broadcast_to(np.eye(3), (len(rgb), 3, 3))
        into = srgb_slope(rgb)[:, None, :]
        if self.name == "linear":
            return np.asarray(into * np.eye(3))
        roots = _root_slope(linear_from_srgb(rgb) @ XYZ_OVER_WHITE.T)
        return np.asarray(_LAB_FROM_ROOTS @ (roots[:, :, None] * XYZ_OVER_WHITE) * into)

    def slopes(self, before: F64, after: F64, matrix: F64) -> F64:
        """Derivative of a linear map in this space by display-encoded colors.

        Args:
            before: [N, 3] display-encoded colors before the map.
            after: [N, 3] the same after the map.
            matrix: [3, 3] the map, in this space.

        Returns:
            [N, 3, 3] d after / d before.
        """
        if self.name == "srgb":
            return np.broadcast_to(matrix, (len(before), 3, 3))
        into, out = srgb_slope(before), 1 / srgb_slope(after)
        if self.name == "lab":
            matrix = np.linalg.inv(_LAB_FROM_ROOTS) @ matrix @ _LAB_FROM_ROOTS
            into_roots = _root_slope(linear_from_srgb(before) @ XYZ_OVER_WHITE.T)
            from_roots = 1 / _root_slope(linear_from_srgb(after) @ XYZ_OVER_WHITE.T)
            middle = from_roots[:, :, None] * matrix * into_roots[:, None, :]
            inner = np.einsum("ik,nkl->nil", np.linalg.inv(XYZ_OVER_WHITE), middle @ XYZ_OVER_WHITE)
        else:
            inner = np.broadcast_to(matrix, (len(before), 3, 3))
        return np.asarray(out[:, :, None] * inner * into[:, None, :])


def _root(light: F64) -> F64:
    """Cube root, replaced by its tangent below the darkest root."""
    tangent = light / (3 * _DARKEST_ROOT**2) + 4 / 29
    return np.where(light > _DARKEST_ROOT**3, np.cbrt(light), tangent)


def _cube(root: F64) -> F64:
    return np.where(root > _DARKEST_ROOT, root**3, 3 * _DARKEST_ROOT**2 * (root - 4 / 29))


def _root_slope(light: F64) -> F64:
    return np.asarray(1 / (3 * np.cbrt(np.maximum(light, _DARKEST_ROOT**3)) ** 2))
