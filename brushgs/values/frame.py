"""A painted picture, with its layers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import DTypeLike, NDArray

from brushgs.core.threads import num_threads_or_default
from brushgs.values.arrays import U8, Array
from brushgs.values.colors import rgb_of
from brushgs.values.layers import DeepSamples, Layer, Matte
from brushgs.values.part import Part
from brushgs.values.paths import Paths
from brushgs.values.png import png_bytes

# Layers of a painting for painting programs, each composited on those below it.


LEAST = 0.5 / 255  # least alpha or light that 8 bits can represent
Mix = Literal["src-over", "multiply", "color-dodge", "plus"]  # names of SVG, without the prefix


@dataclass(frozen=True, eq=False)
class Sheet:
    """One layer.

    Attributes:
        name: of the layer.
        rgb: [H, W, 3] color premultiplied by alpha, display-encoded.
        alpha: [H, W] 0 to 1.
        mix: blend mode on the layers below. Source: W3C, Compositing and Blending Level 1.
    """

    name: str
    rgb: Array  # [H, W, 3]
    alpha: Array  # [H, W]
    mix: Mix = "src-over"


_SHOWN_SIDE = 1024  # pixels: notebooks store what they show, and their columns are about this wide


@dataclass(frozen=True, eq=False)
class Frame:
    """One picture.

    Notebooks show it with its transparency, at most 1024 pixels wide and high. `np.asarray(frame)` gives
    [H, W, 4] RGBA, 0 to 1, straight alpha, for `plt.imshow(frame)`; `np.asarray(frame, np.uint8)` gives bytes
    for `PIL.Image.fromarray`.

    Attributes:
        rgb: [H, W, 3] color premultiplied by alpha, display-encoded, float32 or float64.
        alpha: [H, W] 1 - transmittance, 0 to 1.
        depth: [H, W] alpha-weighted mean camera z, 0 where nothing is painted; or None.
        height: [H, W] height of the paint, pixels: sum over strokes of blending weight times paint height, 0
            where nothing is painted, see `rasterize`; or None.
        layers: the requested layers by name. "depth" and "height" as above; "normal" [H, W, 3] unit vectors
            in camera axes, 0 where nothing is painted; "motion" [H, W, 2] (right, down), pixels to the
            position of the same paint in the next frame; "uv" [H, W, 2] position on the stroke with the
            largest weight, 0 to 1; "unlit" [H, W, 4] the picture without the lamp, premultiplied; mattes
            "stroke", "brush", "region", "layer". Any request adds "paint" [H, W], the coverage by paint, also
            under an opaque ground.
        deep: all strokes of each pixel, if requested; else None.
        paths: the strokes as paths, if requested; else None.
        sheets: coats and light as layers, the lowest first, if requested; else empty.

    Example:
        >>> frame = bg.render(strokes, camera, "flat")
        >>> np.asarray(frame).shape
        (240, 320, 4)
        >>> frame.over("white").shape
        (240, 320, 3)
    """

    rgb: Array  # [H, W, 3]
    alpha: Array  # [H, W]
    depth: Array | None = None  # [H, W]
    height: Array | None = None  # [H, W]
    layers: Mapping[str, Layer] = field(default_factory=dict, kw_only=True)
    deep: DeepSamples | None = field(default=None, kw_only=True)
    paths: Paths | None = field(default=None, kw_only=True)
    sheets: tuple[Sheet, ...] = field(default=(), kw_only=True)

    def __repr__(self) -> str:
        height, width = self.alpha.shape
        facts = [f"{width}x{height}"] + (["float64"] if self.rgb.dtype == np.float64 else [])
        facts += ["depth"] if self.depth is not None else []
        facts += ["height"] if self.height is not None else []
        facts += [f"layers {' '.join(self.layers)}"] if self.layers else []
        facts += ["deep"] if self.deep is not None else []
        return f"Frame({', '.join(facts)})"

    def cut(self, part: Part) -> "Frame":
        """A part of the picture, with its layers.

        Raises:
            ValueError: if the picture does not hold all of it.
        """
        height, width = self.alpha.shape
        if not part.is_in(width, height):
            raise ValueError(f"cut: part must lie in the picture of {width}x{height}, got {part}")
        place = part.rows, part.columns
        planes: dict[str, Any] = {
            name: None if plane is None else np.ascontiguousarray(plane[place])
            for name in ("rgb", "alpha", "depth", "height")
            for plane in (getattr(self, name),)
        }
        layers: dict[str, Layer] = {
            name: replace(layer, rows=layer.rows[place], coverage=layer.coverage[place])
            if isinstance(layer, Matte)
            else layer[place]
            for name, layer in self.layers.items()
        }
        deep = None if self.deep is None else self.deep.cut(part)
        return replace(self, **planes, layers=layers, deep=deep)

    def straight_colors(self) -> Array:
        """[H, W, 3] color with straight (not premultiplied) alpha; 0 where nothing is painted."""
        alpha = self.alpha[..., None]
        return np.divide(self.rgb, alpha, out=np.zeros_like(self.rgb), where=alpha > 0)

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        """[H, W, 4] RGBA for image libraries: display-encoded, straight alpha, clipped to 0 to 1.

        Args:
            dtype: a float dtype, uint8 (0 to 255) or uint16 (0 to 65535); None for that of the frame.
            copy: must not be False: the array is always new.

        Raises:
            TypeError: for another `dtype`.
            ValueError: if `copy` is False.
        """
        if copy is False:
            raise ValueError("Frame: its RGBA is a new array, so copy must not be False")
        kind = self.rgb.dtype if dtype is None else np.dtype(dtype)
        rgba = np.concatenate([self.straight_colors(), self.alpha[..., None]], axis=-1).clip(0, 1)
        if kind.kind == "f":
            return rgba.astype(kind, copy=False)
        if kind not in (np.uint8, np.uint16):
            raise TypeError(f"Frame: dtype must be one of floats, uint8 or uint16, got {kind}")
        return (rgba * np.iinfo(kind).max + 0.5).astype(kind)

    def _repr_png_(self) -> bytes:
        """PNG for notebooks, as `brushgs.save` writes it, reduced if larger than `_SHOWN_SIDE`."""
        height, width = self.alpha.shape
        step = -(-max(height, width) // _SHOWN_SIDE)
        shown = self if step == 1 else Frame(_averaged(self.rgb, step), _averaged(self.alpha, step))
        pixels = np.asarray(shown, np.uint8)
        return png_bytes(pixels[..., :3] if (pixels[..., 3] == 255).all() else pixels)

    def over(self, background: Sequence[float] | Array | str) -> Array:
        """The picture on a background, [H, W, 3].

        Args:
            background: RGB color [3] or image [H, W, 3], display-encoded, 0 to 1; or "#rrggbb" or a color
                name such as "white", "toned" or "gray".

        Raises:
            ValueError: for another shape or an unknown color.
        """
        return np.asarray(self.rgb + (1 - self.alpha[..., None]) * self._behind(background))

    def bytes_over(self, background: Sequence[float] | Array | str) -> U8:
        """The picture on a background as uint8 [H, W, 3]: `over`, clipped and rounded.

        One pass over memory: bit-identical to rounding the result of `over`, in a sixth of the time.

        Args:
            background: see `over`.
        """
        from brushgs.core.native import core as _core

        rgb, alpha, behind = map(np.ascontiguousarray, (self.rgb, self.alpha, self._behind(background)))
        pixels = np.empty(rgb.shape, np.uint8)
        num_threads = num_threads_or_default(None)
        _core.finish(rgb=rgb, alpha=alpha, background=behind, num_threads=num_threads, bytes=pixels)
        return pixels

    def _behind(self, background: Sequence[float] | Array | str) -> Array:
        """The background in the dtype of the frame, [3] or [H, W, 3]."""
        rgb = rgb_of(background) if isinstance(background, str) else background
        behind = np.asarray(rgb, dtype=self.rgb.dtype)
        if behind.shape not in ((3,), self.rgb.shape):
            raise ValueError(
                f"over: background must have shape [3] or {list(self.rgb.shape)}, got {list(behind.shape)}"
            )
        return behind


def _averaged(values: Array, step: int) -> Array:
    """Means of blocks of step x step pixels of [H, W, ...]; those at the right and lower edge are smaller."""
    height, width = values.shape[:2]
    rows, columns = np.arange(0, height, step), np.arange(0, width, step)
    sums = np.add.reduceat(np.add.reduceat(values, rows, axis=0), columns, axis=1)
    counts = np.outer(np.diff(rows, append=height), np.diff(columns, append=width)).astype(values.dtype)
    return np.asarray(sums / counts.reshape(counts.shape + (1,) * (values.ndim - 2)))
