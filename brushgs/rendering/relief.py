"""Relief: how thick the paint of a stroke lies, and how deep its bristles furrow it.

`project` gives each box the thickness of its paint and the gain of its brush's own height, both in pixels;
`rasterize` sums them over the strokes of a pixel to `frame.height`; `light` shines on that. Both belong to
the stroke: they follow from its size among the strokes in space and from its row, never from the view.
"""

from dataclasses import dataclass
from math import inf, sqrt
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from brushgs.arrays import F64, Array
from brushgs.brushes.texture import StrokeTexture
from brushgs.hashing import GOLDEN, uniform
from brushgs.native import core as _core
from brushgs.scene import Boxes, Camera, Gaussians

# At a picture of so many pixels (1000 x 750) lengths on the canvas are what they are said to be.
CANVAS_PIXELS = 750_000
THICKNESS, GAIN = 0.4, 1.7  # px of that picture
# Of a stroke's size over the median size, before its root is taken: large strokes carry more paint.
LEAST_SIZE, MOST_SIZE = 0.4, 2.5
GAIN_SPREAD = 0.25  # standard deviation of the logarithm of the gain from stroke to stroke
MOST_DEVIATIONS = 2.5  # beyond, single strokes stand out like scratches
THICKNESS_SPREAD = 0.5  # the thickness is so much thinner to so much thicker
# Of the thickness of a stroke, in its underpaint, which is smooth; the core has the same.
UNDERPAINT_THICKNESS: float = _core.UNDERPAINT_THICKNESS  # 0.15 / 0.8


def canvas_scale(width: int, height: int) -> float:
    """Pixels of this picture in one of a picture of 1000 x 750: so a painting is the same at any size."""
    return sqrt(width * height / CANVAS_PIXELS)


@dataclass(frozen=True)
class Relief:
    """How high the paint of a stroke of median size lies.

    Attributes:
        thickness: mean thickness of the paint, px of a picture of 1000 x 750, >= 0.
        gain: what the brush's own height, 0 to 1, is multiplied by, in the same pixels, >= 0.
        size: in place of the median size, that of other strokes, see `median_size`; None for the median.

    Raises:
        ValueError: if a value is out of range.
    """

    thickness: float = THICKNESS
    gain: float = GAIN
    size: float | None = None

    def __post_init__(self) -> None:
        for name in ("thickness", "gain"):
            if not 0 <= getattr(self, name) < inf:
                raise ValueError(f"Relief: {name} must be >= 0 and finite, got {getattr(self, name)}")
        if self.size is not None and not 0 <= self.size < inf:
            raise ValueError(f"Relief: size must be >= 0 and finite, got {self.size}")

    def of_boxes(self, gaussians: Gaussians, ids: NDArray[np.int32], camera: Camera) -> Array:
        """[M, 2] `Boxes.reliefs` of boxes of these Gaussians, in the dtype of the scene."""
        pixel = canvas_scale(camera.width, camera.height)
        reliefs: Array = self._of(_in_units(gaussians, self.size)[ids], pixel)
        return reliefs.astype(gaussians.means.dtype)

    def of_strokes(self, gaussians: Gaussians) -> F64:
        """[N, 2] thickness and gain of each stroke, px of a picture of 1000 x 750; see `canvas_scale`."""
        return self._of(_in_units(gaussians, self.size), 1.0)

    def _of(self, units: F64, pixel: float) -> F64:
        return units * (self.thickness * pixel, self.gain * pixel)

    @classmethod
    def of(cls, relief: "bool | Relief | None") -> "Relief | None":
        """What `project` and `render` take: True means the default, False none.

        Raises:
            TypeError: if it is something else.
        """
        if isinstance(relief, cls):
            return relief
        if relief is None or isinstance(relief, bool):
            return cls() if relief else None
        raise TypeError(f"relief must be a bool or a Relief, got {type(relief).__name__}")


def median_size(gaussians: Gaussians) -> float:
    """The median of the geometric mean of the two larger scales, world units; 0 where there is none."""
    return float(np.exp(np.median(_log_sizes(gaussians)))) if len(gaussians) else 0.0


_cache: WeakKeyDictionary[Gaussians, dict[float | None, F64]] = WeakKeyDictionary()


def _in_units(gaussians: Gaussians, size: float | None) -> F64:
    """[N, 2] thickness and gain of each stroke over those of one of usual size; kept while they live."""
    kept = _cache.setdefault(gaussians, {})
    if size not in kept:
        kept[size] = _relative(gaussians, size)
    return kept[size]


def keep_relief(moved: Gaussians, strokes: Gaussians) -> None:
    """Let strokes that have moved have the relief that they have at rest: a stroke keeps its paint."""
    _cache[moved] = _cache.setdefault(strokes, {})


def _log_sizes(gaussians: Gaussians) -> F64:
    # A scale may be 0, or too small to be multiplied: the sum of logarithms is neither.
    with np.errstate(divide="ignore"):
        logs: F64 = np.log(np.sort(gaussians.scales, axis=1)[:, 1:].astype(np.float64))
    return np.asarray(logs.sum(axis=1) / 2)


def _relative(gaussians: Gaussians, size: float | None) -> F64:
    if len(gaussians) == 0:
        return np.empty((0, 2))
    logs = _log_sizes(gaussians)
    with np.errstate(divide="ignore"):
        middle = np.median(logs) if size is None else np.log(size)
    if not np.isfinite(middle):  # at least half of the strokes have no size: all count alike
        logs, middle = np.zeros(len(logs)), np.float64(0)
    relative = np.exp(np.clip(logs - middle, np.log(LEAST_SIZE), np.log(MOST_SIZE)) / 2)
    one, two, three = _uniform(len(gaussians), 3)
    normal = np.sqrt(-2 * np.log1p(-one)) * np.cos(2 * np.pi * two)  # Box and Muller 1958
    gain = np.exp(GAIN_SPREAD * np.clip(normal, -MOST_DEVIATIONS, MOST_DEVIATIONS))
    thickness = 1 + THICKNESS_SPREAD * (2 * three - 1)
    return np.stack([relative * thickness, relative * gain], axis=1)


def _uniform(num_rows: int, num_columns: int) -> F64:
    """[num_columns, num_rows] numbers in [0, 1): hashes of the row."""
    states = np.arange(1, num_rows * num_columns + 1, dtype=np.uint64) * np.uint64(GOLDEN)
    return uniform(states).reshape(num_rows, num_columns).T


def check_relief(where: str, boxes: Boxes) -> None:
    """Raise ValueError if boxes have no reliefs."""
    if boxes.reliefs is None:
        raise ValueError(f"{where}: boxes must have reliefs to have a height; project with relief=True")


def paint_height(texture: StrokeTexture) -> NDArray[np.uint8]:
    """uint8 [h, w] the height of a brush as it is sampled, 255 = 1; where an image has none, its coverage."""
    if texture.height is None:
        return texture.coverage
    return np.rint(np.clip(texture.height, 0, 1) * 255).astype(np.uint8)
