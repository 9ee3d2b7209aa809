"""Relief: thickness of a stroke's paint, and depth of its bristle furrows.

`project` gives each box the thickness of its paint and the gain of its brush's height, both in pixels;
`rasterize` sums them to `frame.height`; `light` lights that. Both depend on the stroke's size among all
strokes, its row and, with `Relief.by_light`, its lightness; never on the view. Moving strokes keep the relief
of their reference moment.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import exp, inf, log, sqrt
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.texture import StrokeTexture
from brushgs.core.native import core as _core
from brushgs.values.arrays import F64, Array
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.colors import CONES_FROM_RGB, OKLAB_FROM_ROOTS
from brushgs.values.gaussians import Gaussians

# Reference picture (1000 x 750) of lengths on the canvas.
CANVAS_PIXELS = 750_000
PIXELS_PER_MM = 6.0  # width of that picture if paper has a size: threads of linen are then 0.6 mm wide
THICKNESS, GAIN = 0.4, 1.7  # px of that picture
# Least OKLab L from fully dark to light, from the core: a painting of one tone has paint of one thickness.
LEAST_LIGHT_RANGE: float = _core.LEAST_LIGHT_RANGE
# Thickness of the smooth underpaint over that of its stroke, from the core.
UNDERPAINT_THICKNESS: float = _core.UNDERPAINT_THICKNESS  # 0.15 / 0.8


def canvas_scale(width: int, height: int, dpi: float | None = None) -> float:
    """Pixels of this picture per pixel of a 1000 x 750 picture, so paintings look the same at any size.

    With a `dpi`, pixels per inch on paper, overlays have a physical size instead.
    """
    return sqrt(width * height / CANVAS_PIXELS) if dpi is None else dpi / 25.4 / PIXELS_PER_MM


@dataclass(frozen=True)
class Relief:
    """Height of the paint of a stroke of median size.

    Attributes:
        thickness: mean thickness of the paint, px of a picture of 1000 x 750, >= 0.
        gain: factor of the brush's height (0 to 1), in the same pixels, >= 0.
        size: reference size in place of the median, see `median_size`; or None.
        by_light: 0 to 1, how far lights are thick and darks thin: at 1 both numbers of a stroke are
            multiplied by 0.25 (dark) to 1.35 (light), by the OKLab lightness of its base color.
        lights: OKLab L of full dark and full light, see `light_range`; None for those of the strokes.
        dpi: pixels per inch on paper; None without a physical size.
        by_place: [N] factors on both numbers of N strokes, by where they lie; None for 1.

    Raises:
        ValueError: if a value is out of range.
    """

    thickness: float = THICKNESS
    gain: float = GAIN
    size: float | None = None
    by_light: float = 0.0
    lights: tuple[float, float] | None = None
    dpi: float | None = None
    by_place: Callable[[Gaussians], F64] | None = None

    def __post_init__(self) -> None:
        for name in ("thickness", "gain"):
            if not 0 <= getattr(self, name) < inf:
                raise ValueError(f"Relief: {name} must be >= 0 and finite, got {getattr(self, name)}")
        if self.size is not None and not 0 <= self.size < inf:
            raise ValueError(f"Relief: size must be >= 0 and finite, got {self.size}")
        if not 0 <= self.by_light <= 1:
            raise ValueError(f"Relief: by_light must be 0 to 1, got {self.by_light}")
        if self.lights is not None and not 0 <= self.lights[0] <= self.lights[1] <= 1:
            raise ValueError(f"Relief: lights must be 0 to 1 and ascend, got {self.lights}")

    def of_boxes(self, gaussians: Gaussians, ids: NDArray[np.int32], camera: Camera) -> Array:
        """[M, 2] `Boxes.reliefs` of boxes of these Gaussians, in the dtype of the scene."""
        pixel = self._pixel(camera.width, camera.height)
        reliefs: Array = self._of(self._in_units(gaussians)[ids], pixel)
        return reliefs.astype(gaussians.means.dtype)

    def _pixel(self, width: int, height: int) -> float:
        """Pixels of a picture per pixel of one of 1000 x 750, for the thickness of paint.

        On paper it is halfway to the physical scale: a larger print has thicker paint, as its strokes are
        larger, but with sharper light, ridges at the full physical scale would look like ploughed earth.
        """
        of_picture = canvas_scale(width, height)
        if self.dpi is None:
            return of_picture
        return sqrt(of_picture * canvas_scale(width, height, self.dpi))

    def of_strokes(self, gaussians: Gaussians) -> F64:
        """[N, 2] thickness and gain of each stroke, px of a picture of 1000 x 750; see `canvas_scale`."""
        return self._of(self._in_units(gaussians), 1.0)

    def in_lights_of(self, strokes: Gaussians) -> "Relief":
        """The same relief with the dark and light of these strokes; itself if `by_light` is 0.

        Used for other coats, such as a backdrop, and for sets that include further strokes.
        """
        return replace(self, lights=light_range(strokes)) if self.by_light else self

    def _in_units(self, gaussians: Gaussians) -> F64:
        """[N, 2] relative thickness and gain of each stroke; cached per strokes."""
        strokes = _at_rest.get(gaussians, gaussians)
        kept = _cache.setdefault(strokes, {})
        key = (self.size, self.by_light, self.lights, self.by_place)
        if key not in kept:
            units = self._relative(strokes)
            if self.by_place is not None:
                units *= self.by_place(strokes)[:, None]
            kept[key] = units
        return kept[key]

    def _relative(self, strokes: Gaussians) -> F64:
        """[N, 2] as `_in_units`, wherever strokes lie."""
        units = np.empty((len(strokes), 2))
        if len(strokes) == 0:
            return units
        columns = paint_arguments(strokes)
        middle = _core.median_log_size(columns["scales"])
        if self.size is not None:
            middle = log(self.size) if self.size > 0 else -inf
        dark, light = self.lights or (light_range(strokes) if self.by_light else (0.0, 1.0))
        _core.relative_reliefs(
            **columns, middle=middle, by_light=self.by_light, dark=dark, light=light, reliefs=units
        )
        return units

    def _of(self, units: F64, pixel: float) -> F64:
        return units * (self.thickness * pixel, self.gain * pixel)

    @classmethod
    def of(cls, relief: "bool | Relief | None") -> "Relief | None":
        """A relief argument of `project` and `render`: True is the default, False none.

        Raises:
            TypeError: if it is something else.
        """
        if isinstance(relief, cls):
            return relief
        if relief is None or isinstance(relief, bool):
            return cls() if relief else None
        raise TypeError(f"relief must be a bool or a Relief, got {type(relief).__name__}")


def median_size(gaussians: Gaussians) -> float:
    """The median of the geometric mean of the two larger scales, world units; 0 without strokes."""
    if len(gaussians) == 0:
        return 0.0
    return exp(_core.median_log_size(np.ascontiguousarray(gaussians.scales)))


def light_range(gaussians: Gaussians) -> tuple[float, float]:
    """OKLab L of the 0.4 and 0.8 quantiles of painted area.

    The area of a stroke is its opacity times the product of its two larger scales. (0, 1) without strokes.
    """
    dark, light = _core.light_range(**paint_arguments(gaussians))
    return dark, light


_Place = Callable[[Gaussians], F64]
# By size, by_light, lights and by_place of a relief.
_Kept = dict[tuple[float | None, float, tuple[float, float] | None, _Place | None], F64]
_cache: WeakKeyDictionary[Gaussians, _Kept] = WeakKeyDictionary()
_at_rest: WeakKeyDictionary[Gaussians, Gaussians] = WeakKeyDictionary()  # moved strokes -> strokes at rest


def keep_relief(moved: Gaussians, strokes: Gaussians) -> None:
    """Let moved strokes keep the relief that they have at rest, independent of the order of painting.

    Args:
        moved: strokes at some moment, row by row.
        strokes: the same at their reference moments; `moved` itself if nothing moves.
    """
    if moved is not strokes:
        _at_rest[moved] = _at_rest.get(strokes, strokes)


def paint_arguments(gaussians: Gaussians) -> dict[str, Any]:
    """The columns of paint, for functions of the core: `PaintedStrokes`."""
    columns = {name: np.ascontiguousarray(getattr(gaussians, name)) for name in ("scales", "opacities", "sh")}
    return {**columns, "cones_from_rgb": CONES_FROM_RGB, "lab_from_roots": OKLAB_FROM_ROOTS}


def check_relief(where: str, boxes: Boxes) -> None:
    """Raise ValueError if boxes have no reliefs."""
    if boxes.reliefs is None:
        raise ValueError(f"{where}: boxes must have reliefs to have a height; project with relief=True")


def paint_height(texture: StrokeTexture) -> NDArray[np.uint8]:
    """uint8 [h, w] height of a brush for sampling, 255 = 1; its coverage if it has none."""
    if texture.height is None:
        return texture.coverage
    return np.rint(np.clip(texture.height, 0, 1) * 255).astype(np.uint8)
