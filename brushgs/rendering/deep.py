"""Deep samples: all strokes of each pixel, which composited front to back give the picture.

A fragment of weight w behind a total weight W becomes a sample of alpha w / (1 - W). Its color is that of
the stroke under the glazes above it and the light on the pixel; light is affine in color, so each stroke can
be lit alone.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.rendering.fragments import Fragments
from brushgs.rendering.marks import LaidCoat, Marks
from brushgs.values.arrays import Array
from brushgs.values.layers import DeepSamples

if TYPE_CHECKING:
    from brushgs.rendering.light import Lamp

BEHIND = 1.01  # depth of the ground over that of the farthest stroke


@dataclass(frozen=True, eq=False)
class Rest:
    """The layer behind all strokes: the ground, or glazes without a ground.

    Attributes:
        rgb: [H, W, 3] premultiplied.
        alpha: [H, W].
    """

    rgb: Array  # [H, W, 3]
    alpha: Array  # [H, W]

    @classmethod
    def ground(cls, rgb: Array, tint: Array | None) -> "Rest":
        """An opaque ground, seen through the tint of glazes."""
        return cls(rgb if tint is None else rgb * tint, np.ones(rgb.shape[:2], rgb.dtype))

    @classmethod
    def glazes(cls, tint: Array) -> "Rest":
        """Glazes without a ground: color and alpha that look the same on white."""
        darkest = tint.min(axis=2)
        return cls(tint - darkest[..., None], 1 - darkest)


@dataclass(frozen=True, eq=False)
class Lighting:
    """The light on a picture: lit = factor x color + shine x alpha, premultiplied.

    Attributes:
        factors: [H, W].
        shines: [H, W].
    """

    factors: Array  # [H, W]
    shines: Array  # [H, W]

    @classmethod
    def of(cls, height: Array, lamp: "Lamp", blur: float, scale: float) -> "Lighting":
        """The lighting of a lamp on paint of this height, see `light`."""
        from brushgs.rendering.light import light

        black = np.zeros((*height.shape, 3), height.dtype)
        shines = light(black, height, lamp, blur=blur, scale=scale)[..., 0]
        factors = light(black + 1, height, lamp, blur=blur, scale=scale)[..., 0] - shines
        return cls(np.ascontiguousarray(factors), np.ascontiguousarray(shines))


class DeepMaker:
    """Collects samples, a band of rows at a time.

    Args:
        marks: of the view.
        rest: the layer behind the strokes, or None.
        lighting: None for none.
    """

    def __init__(self, marks: Marks, rest: Rest | None, lighting: Lighting | None) -> None:
        self._marks, self._rest, self._lighting = marks, rest, lighting
        depths = marks.each(lambda _, laid: laid.boxes.depths, marks.dtype)
        setbacks = marks.each(
            lambda _, laid: np.zeros(len(laid.boxes)) if laid.boxes.setbacks is None else laid.boxes.setbacks,
            marks.dtype,
        )
        self._of_marks = {
            "colors": marks.each(lambda _, laid: _colors(laid), marks.dtype, 3),
            "depths": depths,
            "setbacks": setbacks,
            "ids": (marks.numbers + 1).astype(np.uint32),
            "coats": marks.coats.astype(np.uint8),
        }
        self._rest_depth = BEHIND * float((depths + setbacks).max(initial=marks.camera.near))
        self._tints = _tints_over(marks)
        self._parts: list[tuple[NDArray[Any], ...]] = []

    def add(self, rows: slice, fragments: Fragments) -> None:
        """Add the fragments of the next band of rows."""

        def part(plane: Array | None, *shape: int) -> Array | None:
            return (
                None
                if plane is None
                else np.ascontiguousarray(plane[rows], self._marks.dtype).reshape(-1, *shape)
            )

        rest_alpha = None if self._rest is None else part(self._rest.alpha)
        counts = np.diff(fragments.starts) + (0 if rest_alpha is None else rest_alpha > 0)
        starts = np.concatenate([np.zeros(1, np.int64), np.cumsum(counts)])
        total = int(starts[-1])
        colors, alphas, depths = np.empty((total, 3), np.float32), *np.empty((2, total), np.float32)
        ids = np.empty(total, np.uint32)
        _core.make_samples(
            starts=fragments.starts,
            marks=fragments.marks,
            weights=fragments.weights,
            shades=fragments.shades,
            is_underpaint=fragments.is_underpaint,
            **self._of_marks,
            tints=[part(tint, 3) for tint in self._tints],
            rest_rgb=None if self._rest is None else part(self._rest.rgb, 3),
            rest_alpha=rest_alpha,
            rest_depth=self._rest_depth,
            factors=None if self._lighting is None else part(self._lighting.factors),
            shines=None if self._lighting is None else part(self._lighting.shines),
            sample_starts=starts,
            sample_colors=colors,
            sample_alphas=alphas,
            sample_depths=depths,
            sample_ids=ids,
            num_threads=num_threads_or_default(self._marks.num_threads),
        )
        self._parts.append((counts, colors, alphas, depths, ids))

    def result(self) -> DeepSamples:
        """The samples of the whole picture."""
        counts, colors, alphas, depths, ids = (
            np.concatenate(each) for each in zip(*self._parts, strict=True)
        )
        starts = np.concatenate([np.zeros(1, np.int64), np.cumsum(counts)])
        camera = self._marks.camera
        return DeepSamples(starts, colors, alphas, depths, ids, camera.height, camera.width)


def _colors(laid: LaidCoat) -> Array:
    """[M, 3] of the boxes; white where an effect gives the colors, as a tint of the samples."""
    return laid.boxes.colors if laid.picture is None else np.ones_like(laid.boxes.colors)


def _tints_over(marks: Marks) -> list[Array | None]:
    """[H, W, 3] of each covering coat, the product of the glazes above it and the picture of its effect.

    Empty without any.
    """
    tints: list[Array | None] = []
    above: Array | None = None
    for laid in reversed(marks.all_laid):
        if laid.tint is not None:
            above = laid.tint if above is None else above * laid.tint
        elif laid.picture is None:
            tints.insert(0, above)
        else:
            tints.insert(0, laid.picture if above is None else above * laid.picture)
    return tints if any(tint is not None for tint in tints) else []
