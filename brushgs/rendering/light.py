"""A picture and its height -> the picture lit by a lamp, with shaded ridges of paint and highlights.

The lamp is fixed to the canvas, or stands in the scene, where its direction depends on the view. Pixels of
flat height do not change by a bit.
"""

from dataclasses import dataclass, replace
from math import atan2, cos, hypot, inf, pi, sin, sqrt
from typing import Any

import numpy as np

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.rendering.relief import canvas_scale
from brushgs.values.arrays import F64, Array, check
from brushgs.values.camera import Camera

BLUR = 0.6  # px of a 1000 x 750 picture, standard deviation; if sharper, single pixels sparkle
BLUR_MOVING = 3.0  # the same while the camera moves, see `Painting.is_moving`
# Above a strength of 0.9 or a gloss of 0.15, paint looks like plastic.
STRENGTH, GLOSS, EXPONENT = 0.5, 0.06, 40
MOST_STRENGTH = 0.85
MOST_EXPONENT = 1000
LEAST_RISE = sin(52 * pi / 180)  # sine of the least elevation of a lamp in the scene
REACH = 3  # of the blur, standard deviations


@dataclass(frozen=True)
class Lamp:
    """A distant lamp.

    Attributes:
        azimuth: direction on the canvas, radians from +x (right) towards +y (down); the default is upper
            left.
        elevation: above the canvas, radians, in (0, pi / 2].
        strength: contrast of shading, 0 to 1; see `at_relief`.
        gloss: brightness of highlights, 0 to 1.
        exponent: specular exponent, 1 to 1000; higher gives smaller highlights.
        towards: unit vector toward a lamp in the scene, world axes; the view then decides azimuth and
            elevation, see `seen_by`. None for a lamp fixed to the canvas.

    Raises:
        TypeError: if `exponent` is not an integer.
        ValueError: if a value is out of range.
    """

    azimuth: float = 5 * pi / 4
    elevation: float = 52 * pi / 180
    strength: float = STRENGTH
    gloss: float = GLOSS
    exponent: int = EXPONENT
    towards: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        if not -inf < self.azimuth < inf:
            raise ValueError(f"Lamp: azimuth must be finite, got {self.azimuth}")
        if not 0 < self.elevation <= pi / 2:
            raise ValueError(f"Lamp: elevation must be above 0 to pi / 2, got {self.elevation}")
        for name in ("strength", "gloss"):
            if not 0 <= getattr(self, name) <= 1:
                raise ValueError(f"Lamp: {name} must be in 0 to 1, got {getattr(self, name)}")
        if not isinstance(self.exponent, int):
            raise TypeError(f"Lamp: exponent must be an int, got {type(self.exponent).__name__}")
        if not 1 <= self.exponent <= MOST_EXPONENT:
            raise ValueError(f"Lamp: exponent must be in 1 to {MOST_EXPONENT}, got {self.exponent}")

    def at_relief(self, relief: float) -> "Lamp":
        """The lamp with the strength for a relief of 0 (none) to 1 (just below a plastic look).

        0.59 gives the default strength.

        Raises:
            ValueError: if `relief` is out of range.
        """
        if not 0 <= relief <= 1:
            raise ValueError(f"Lamp: relief must be in 0 to 1, got {relief}")
        return replace(self, strength=MOST_STRENGTH * relief)

    def seen_by(self, camera: Camera) -> "Lamp":
        """The lamp relative to the canvas of a view; a lamp fixed to the canvas is unchanged.

        It never shines from behind, nor flatter than `LEAST_RISE`: paint lit from the side looks like
        plaster. It moves continuously as the camera turns; right in front of or behind the picture, ridges
        have no shade.
        """
        if self.towards is None:
            return self
        right, down, ahead = camera.viewmat[:3, :3] @ np.asarray(self.towards)
        rise = atan2(max(-ahead, LEAST_RISE), hypot(right, down))
        return replace(self, azimuth=atan2(down, right), elevation=rise)

    @property
    def direction(self) -> F64:
        """[3] unit vector to the lamp: x right, y down, z from the canvas to the eye."""
        level = cos(self.elevation)
        return np.array([cos(self.azimuth) * level, sin(self.azimuth) * level, sin(self.elevation)])

    @property
    def half_way(self) -> F64:
        """[3] half vector between lamp and eye, for highlights."""
        x, y, z = self.direction
        length = sqrt(x * x + y * y + (z + 1) ** 2)
        return np.array([x, y, z + 1]) / length


def light(
    rgb: Array,
    height: Array,
    lamp: Lamp | None = None,
    *,
    alpha: Array | None = None,
    blur: float = BLUR,
    scale: float | None = None,
    num_threads: int | None = None,
    out: Array | None = None,
) -> Array:
    """Light a picture with a lamp.

    With n the unit normal of the slightly blurred height, L the direction to the lamp and H the half vector
    to the eye: rgb x (1 + strength x (clip(n . L / L_z, 0, 2) - 1)) + gloss x clip((n . H)^exponent -
    H_z^exponent, 0, 1). Slopes are central differences; the border of the picture is extended. Highlights may
    exceed 1.
    Source: Hertzmann 2002, Fast Paint Texture; highlights: Blinn 1977. Defined by `rendering/reference.py`.

    Args:
        rgb: [H, W, 3] colors, display-encoded, float32 or float64.
        height: [H, W] pixels, like `Frame.height`, in the same dtype.
        lamp: None takes `Lamp()`.
        alpha: [H, W] of premultiplied colors, scales highlights; None: opaque.
        blur: standard deviation of the blur of the height, px of a picture of 1000 x 750, 0 to 10.
        scale: pixels of the picture per one of those; None by its size, see `canvas_scale`.
        num_threads: None takes the processors available to this process. The picture does not depend on it.
        out: [H, W, 3] contiguous output array, such as `rgb` itself; None for a new one.

    Returns:
        [H, W, 3] in the dtype of `rgb`; `out` if given. Pixels of flat height equal `rgb` bit for bit.

    Raises:
        TypeError: if arrays have other dtypes.
        ValueError: if shapes do not match, or `blur` is out of range.

    Example:
        >>> paint = bg.render(strokes, camera, "impasto", relief=True)
        >>> lit = bg.light(paint.rgb, paint.height, bg.Lamp(gloss=0.2), alpha=paint.alpha)
        >>> lit.shape
        (240, 320, 3)
    """
    lamp = Lamp() if lamp is None else lamp
    arrays = {"rgb": (rgb, "H W 3"), "height": (height, "H W")}
    if alpha is not None:
        arrays["alpha"] = (alpha, "H W")
    check("light", **arrays)
    if rgb.dtype not in (np.float32, np.float64):
        raise TypeError(f"light: rgb must be float32 or float64, got {rgb.dtype}")
    for name, (array, _) in arrays.items():
        if array.dtype != rgb.dtype:
            raise TypeError(f"light: {name} must be {rgb.dtype} like rgb, got {array.dtype}")
    if out is not None and (out.shape != rgb.shape or out.dtype != rgb.dtype or not out.flags.c_contiguous):
        raise ValueError("light: out must be a contiguous array of the shape and the dtype of rgb")
    taps = blur_taps(blur, canvas_scale(rgb.shape[1], rgb.shape[0]) if scale is None else scale)
    new_plane: Any = _core.new_plane_float32 if rgb.dtype == np.float32 else _core.new_plane_float64
    lit: Array = new_plane(list(rgb.shape)) if out is None else out
    towards, half_way = lamp.direction, lamp.half_way
    if lit.size:
        _core.light(
            rgb=np.ascontiguousarray(rgb),
            height=np.ascontiguousarray(height),
            alpha=None if alpha is None else np.ascontiguousarray(alpha),
            blur=taps,
            lamp=towards[:2] / towards[2],
            half_way=half_way[:2] / half_way[2],
            strength=float(lamp.strength),
            gloss=float(lamp.gloss),
            exponent=lamp.exponent,
            num_threads=num_threads_or_default(num_threads),
            lit=lit,
        )
    return lit


def blur_taps(blur: float, scale: float) -> F64:
    """[2 r + 1] weights of the height blur along either axis; `scale` as of `light`.

    Raises:
        ValueError: if `blur` is out of range.
    """
    if not 0 <= blur <= 10:
        raise ValueError(f"light: blur must be in 0 to 10 pixels, got {blur}")
    deviation = blur * scale
    radius = int(np.ceil(REACH * deviation - 0.5)) if deviation > 1 / 6 else 0
    offsets = np.arange(-radius, radius + 1)
    weights = np.exp(-0.5 * (offsets / max(deviation, 1e-9)) ** 2)
    return np.asarray(weights / weights.sum())
