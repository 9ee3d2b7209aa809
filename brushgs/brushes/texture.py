"""`StrokeTexture`: the coverage of one stroke, and its relief, from a stroke image.

u, the stroke's direction, runs along the columns (left to right), v along the rows (downward). The built-in
images are in `strokes/`; two analytic kernels, `gaussian` and `ellipse`, need no image. `levels` filters
textures for small boxes, `rendering.rasterize` draws with them.
"""

import math
import os
import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError, SceneWarning
from brushgs.formats.files import exists
from brushgs.options.choices import STYLE_SUFFIX
from brushgs.values.arrays import check
from brushgs.values.colors import LUMINANCE, split_alpha

KERNELS = ("gaussian", "ellipse")  # computed, not drawn
# Half length of a box in standard deviations: the published stroke covers 2, the 3DGS kernel is clipped at 3.
KERNEL_SIGMAS = {"gaussian": 3.0, "ellipse": 2.0, "image": 2.0}
# Length of a stroke over that which paints the area of its Gaussian, so that neighbors overlap. On five
# scenes with `swirl` and `flat` 1.0 to 1.1 has the lowest error but leaves more unpainted.
FITTED_REACH = 1.2
LONG_SIDE = 256  # texels of a stroke image; more are invisible in pictures below 4K
OPAQUE = 254.5 / 255  # an alpha channel without values below this is not the coverage
CANVAS = 0.5  # height without paint
_ROWS_AT_A_TIME = 64  # of an image
_VARIANT = re.compile(r"_(\d+)$")  # after the name of a stroke
# A brush of a style, such as "monet.style:2": the first is 1.
_OF_STYLE = re.compile(
    rf"(?P<file>.+{re.escape(STYLE_SUFFIX)}):(?P<number>\d{{1,9}})", re.IGNORECASE | re.DOTALL
)
BLANK = 0.02  # coverage read from luminance below this is paper grain or JPEG noise
GREY = 0.04  # difference of channels up to which an image has no color
MOST_ON_BORDER = 0.1  # mean coverage along the border of an image, above which a note is given


TINT_ZERO = 128  # of 0 to 255: adds nothing


@dataclass(frozen=True, eq=False)
class Tint:
    """The colors of a brush, display-encoded RGB, added to the color of a stroke texel by texel.

    Attributes:
        mean: [3] color of the brush itself, 0 to 1, to which its texels are relative.
        texels: uint8 [h, w, 3] in steps of `step` from `TINT_ZERO`; u runs along the columns.
        step: 0 or more.
    """

    mean: NDArray[np.float64]
    texels: NDArray[np.uint8]
    step: float

    @classmethod
    def of(cls, rgb: NDArray[Any], coverage: NDArray[np.uint8], mean: NDArray[Any] | None = None) -> "Tint":
        """The tint of an image [h, w, 3], 0 to 1, relative to the mean of its paint or another color."""
        weights = coverage.astype(np.float64)[..., None]
        if mean is None:
            mean = (weights * rgb).sum(axis=(0, 1)) / max(float(weights.sum()), 1.0)
        away = np.where(weights > 0, rgb - mean, 0.0)
        step = float(np.abs(away).max()) / (TINT_ZERO - 1)
        texels = np.full(away.shape, TINT_ZERO, np.uint8)
        if step > 0:
            texels = (np.rint(away / step) + TINT_ZERO).astype(np.uint8)
        return cls(np.asarray(mean, np.float64), texels, step)

    def scaled(self, amount: float) -> "Tint":
        """The tint with its differences scaled by `amount`, 0 (none) to 1."""
        return Tint(self.mean, self.texels, self.step * amount)


@dataclass(frozen=True, eq=False)
class StrokeTexture:
    """The mark of one stroke in its box.

    Attributes:
        kind: "image", or an analytic kernel over the box with s and t in [-1, 1]: "gaussian" is
            exp(-4.5 (s^2 + t^2)), the 3DGS kernel clipped at 3 sigma; "ellipse" is 1 where s^2 + t^2 < 1.
        name: for reports.
        coverage: uint8 [h, w] paint mask, 255 = full; u runs along the columns. 1 x 1 for kernels.
        height: float32 [h, w] relief of the paint, 0 to 1, 0.5 is the canvas; or None.
        num_sigmas: half length of a stroke's box in standard deviations, > 0.
        has_bristles: whether bristles leave streaks in it, see `brushgs.rendering.streaks`.
        tint: colors of its own, those of bristles included, so it has no streaks; None for a gray brush.

    Raises:
        TypeError: if an array has another dtype.
        ValueError: if `kind` is unknown, a shape is wrong or `num_sigmas` is not positive.
    """

    kind: Literal["image", "gaussian", "ellipse"]
    name: str
    coverage: NDArray[np.uint8]  # [h, w]
    height: NDArray[np.float32] | None = None  # [h, w]
    num_sigmas: float = KERNEL_SIGMAS["image"]
    has_bristles: bool = True
    tint: "Tint | None" = None

    def __post_init__(self) -> None:
        if self.kind not in KERNEL_SIGMAS:
            raise ValueError(
                f"StrokeTexture: kind must be one of {', '.join(KERNEL_SIGMAS)}, got {self.kind!r}"
            )
        if not self.num_sigmas > 0:
            raise ValueError(f"StrokeTexture: num_sigmas must be > 0, got {self.num_sigmas}")
        check("StrokeTexture", coverage=(self.coverage, "h w"))
        if 0 in self.coverage.shape:
            raise ValueError(f"StrokeTexture: coverage must have texels, got {list(self.coverage.shape)}")
        arrays: list[tuple[str, NDArray[Any], type]] = [("coverage", self.coverage, np.uint8)]
        if self.height is not None:
            check("StrokeTexture", coverage=(self.coverage, "h w"), height=(self.height, "h w"))
            arrays.append(("height", self.height, np.float32))
        if self.tint is not None:
            check("StrokeTexture", coverage=(self.coverage, "h w"), tint=(self.tint.texels, "h w 3"))
            object.__setattr__(self, "has_bristles", False)
        for field, array, dtype in arrays:
            if array.dtype != dtype:
                raise TypeError(f"StrokeTexture: {field} must be {dtype.__name__}, got {array.dtype}")
            array = np.ascontiguousarray(array).view()
            array.flags.writeable = False
            object.__setattr__(self, field, array)

    def __repr__(self) -> str:
        if self.kind != "image":
            return f"StrokeTexture({self.name!r})"
        h, w = self.coverage.shape
        more = ("" if self.height is None else ", height") + ("" if self.tint is None else ", colors")
        return f"StrokeTexture({self.name!r}, {w}x{h}{more})"

    @property
    def is_directed(self) -> bool:
        """Whether it has a direction: a stroke image does, the built-in kernels do not."""
        return self.kind == "image"

    @property
    def coverages(self) -> tuple[NDArray[np.uint8], ...]:
        """Its coverage as a tuple, as in `BrushSet`."""
        return (self.coverage,)

    @property
    def fitted_sigmas(self) -> float:
        """Half length of a box in standard deviations, fitted to the painted area of a Gaussian.

        A Gaussian of deviation s paints an area of 2 pi s^2, a stroke of half length n s paints (2 n s)^2 x
        mean coverage. These are equal at n = sqrt(pi / (2 mean)); the result is `FITTED_REACH` times that, at
        most `num_sigmas`, so full brushes are drawn smaller than lacy ones. Kernels keep `num_sigmas`.
        """
        mean = float(self.coverage.mean()) / 255
        if self.kind != "image" or mean == 0:
            return self.num_sigmas
        return min(self.num_sigmas, FITTED_REACH * math.sqrt(math.pi / (2 * mean)))

    @classmethod
    def open(
        cls, name_or_path: str | Path, *, size: int = LONG_SIDE, colored: bool = False
    ) -> "StrokeTexture":
        """A built-in stroke by name, or any image file.

        Built-in names (`builtin_names()`) may have capitals, spaces or hyphens ("Dry Brush"), and the number
        of a variant ("flat_2"). Text with a suffix or folder ("flat.png", "./flat"), or a `Path`, is a file.
        Brushes of a style are numbered from 1: "monet.style:2".

        In a file, coverage is the alpha channel. Without one, or if it is fully opaque, coverage is the
        difference in luminance from the median of the border (dark paint on light background or the reverse),
        scaled to a maximum of 1. The image is cropped to its paint, and averaged down to a longest side of
        `size`; smaller images are not enlarged.

        Args:
            name_or_path: name or path.
            size: longest side kept, texels, >= 1.
            colored: whether an image with color in it keeps it, see `Tint`; the marks of a style always do.

        Raises:
            SceneError: if there is no such name or file, the image has no paint, or the style has fewer
                brushes.
            ValueError: if `size` is below 1.

        Warns:
            SceneWarning: if an image without transparency has one flat tone (it becomes a solid rectangle),
            or paint reaches its border.

        Example:
            >>> bg.StrokeTexture.open("flat")
            StrokeTexture('flat', 247x91, height)
        """
        if size < 1:
            raise ValueError(f"StrokeTexture.open: size must be at least 1, got {size}")
        path, text = Path(name_or_path), str(name_or_path)
        if (of_style := brush_of_style(text)) is not None:
            return cls._from_style(*of_style, size)
        name = _plain_name(path.stem)
        if isinstance(name_or_path, str) and not path.suffix and "/" not in text and os.sep not in text:
            if name in KERNELS:
                return cls._kernel(name)
            if builtin := variants_of(name):
                file, usual = strokes_folder() / f"{builtin[0]}.png", size == LONG_SIDE
                return _usual(file, builtin[0]) if usual else cls._from_file(file, builtin[0], size)
            if not exists(path):
                raise SceneError(path, _unknown(name))
        elif not exists(path) and variants_of(path.stem):
            raise SceneError(text, f"there is no such file; for the built-in stroke write {name}")
        return cls._from_file(path, path.stem, size, colored=colored)

    @classmethod
    def of(cls, stroke: "StrokeTexture | str | Path | NDArray[Any]") -> "StrokeTexture":
        """A texture from a texture, a name, a path or a picture, as taken by `render`.

        An array [h, w] is a coverage, see `from_coverage`; [h, w, C] is a picture as read by `open`.

        Raises:
            TypeError: if it is something else.
            SceneError: see `open`.
        """
        if isinstance(stroke, cls):
            return stroke
        if isinstance(stroke, str | Path):
            return cls.open(stroke)
        if isinstance(stroke, np.ndarray):
            return cls.from_coverage(stroke) if stroke.ndim == 2 else cls._from_array(stroke)
        raise TypeError(
            "texture must be a StrokeTexture, the name of a stroke, a path or a picture as an array, got "
            f"{type(stroke).__name__}"
        )

    @classmethod
    def from_coverage(
        cls, coverage: NDArray[Any], *, height: NDArray[np.float32] | None = None, name: str = "coverage"
    ) -> "StrokeTexture":
        """A stroke from an array, without cropping or resampling.

        Args:
            coverage: [h, w] paint mask; uint8 with 255 = full, or floats from 0 to 1 (rounded to 8 bits).
            height: float32 [h, w] relief of the paint, 0 to 1.
            name: for reports.

        Raises:
            TypeError: if `coverage` is neither uint8 nor floating.
            ValueError: if it is not two-dimensional, has no texels, or a float is NaN or outside 0 to 1.

        Example:
            >>> bg.StrokeTexture.from_coverage(np.ones((8, 32), np.float32), name="bar")
            StrokeTexture('bar', 32x8)
        """
        check("from_coverage", coverage=(coverage, "h w"))
        if np.issubdtype(coverage.dtype, np.floating):
            outside = ~((coverage >= 0) & (coverage <= 1))
            if outside.any():
                row, column = np.argwhere(outside)[0]
                raise ValueError(
                    f"from_coverage: coverage must lie in 0 to 1, got {np.count_nonzero(outside)} texels "
                    f"outside, first {coverage[row, column]} at [{row}, {column}]"
                )
            coverage = np.rint(coverage * 255).astype(np.uint8)
        elif coverage.dtype != np.uint8:
            raise TypeError(f"from_coverage: coverage must be uint8 or floating, got {coverage.dtype}")
        return cls("image", name, coverage.copy(), height)

    @classmethod
    def _kernel(cls, name: Any) -> "StrokeTexture":
        return cls(name, name, np.full((1, 1), 255, np.uint8), None, KERNEL_SIGMAS[name])

    @classmethod
    def _from_style(cls, path: Path, number: int | None, size: int) -> "StrokeTexture":
        from brushgs.brushes.of_style import mark_texture, marks_of

        marks = marks_of(path)
        if marks is None or not (marks.brushes or marks.dictionary):
            raise SceneError(path, "the style has no brushes; choose a stroke that comes with the program")
        brushes, dictionary = marks.brushes, marks.dictionary
        total = len(brushes) + (0 if dictionary is None else len(dictionary))
        if number is None or not 1 <= number <= total:
            have = "1 brush" if total == 1 else f"{total} brushes"
            raise SceneError(path, f"the style has {have}; name one of them, such as {path}:1")
        if dictionary is not None and number > len(brushes):
            row, name = number - len(brushes) - 1, name_in_style(path, number)
            return mark_texture(dictionary, row, name, marks.length / marks.aspect)
        coverage = brushes[number - 1].astype(np.float32) / np.float32(255)
        small = _average(coverage, _shape_within(coverage.shape, size))
        return cls("image", name_in_style(path, number), np.rint(np.clip(small, 0, 1) * 255).astype(np.uint8))

    @classmethod
    def _from_array(cls, picture: NDArray[Any]) -> "StrokeTexture":
        if picture.ndim != 3 or not 1 <= picture.shape[2] <= 4 or not picture.size:
            shape = "x".join(map(str, picture.shape))
            raise ValueError(f"texture must be a picture [h, w] or [h, w, 1 to 4], got an array {shape}")
        if picture.dtype != np.uint8 and not np.issubdtype(picture.dtype, np.floating):
            raise TypeError(f"texture must be uint8 or floating, got an array of {picture.dtype}")
        pixels = picture.astype(np.float32) / np.float32(255 if picture.dtype == np.uint8 else 1)
        if not ((pixels >= 0) & (pixels <= 1)).all():
            raise ValueError("texture must lie in 0 to 1 where it is floating, got values outside")
        return cls._of_pixels(pixels, Path("picture"), "picture", LONG_SIDE)

    @classmethod
    def _from_file(cls, path: Path, name: str, size: int, *, colored: bool = False) -> "StrokeTexture":
        from brushgs.formats.pictures.images import read_image

        return cls._of_pixels(read_image(path), path, name, size, colored=colored)

    @classmethod
    def _of_pixels(
        cls, pixels: NDArray[np.float32], path: Path, name: str, size: int, *, colored: bool = False
    ) -> "StrokeTexture":
        coverage, height = _coverage_and_height(pixels, path)
        rows = np.flatnonzero((coverage >= 0.5 / 255).any(axis=1))
        columns = np.flatnonzero((coverage >= 0.5 / 255).any(axis=0))
        if len(rows) == 0:
            raise SceneError(path, "the stroke is fully transparent; give an image with paint in it")
        crop = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
        coverage, pixels = coverage[crop], pixels[crop]
        shape = _shape_within(coverage.shape, size)
        small = _average(coverage, shape)
        if height is not None:  # weighted by coverage
            relief = _average(height[crop] * coverage, shape) / np.maximum(small, 1e-6)
            height = np.where(small > 0, np.clip(relief, 0, 1), np.float32(CANVAS))
        steps = np.rint(np.clip(small, 0, 1) * 255).astype(np.uint8)
        tint = _tint_of(pixels, coverage, steps) if colored else None
        return cls("image", name, steps, height, tint=tint)


@cache
def _usual(path: Path, name: str) -> StrokeTexture:
    """A built-in stroke in the usual size, decoded once by a process: all together take some 8 MB."""
    return StrokeTexture._from_file(path, name, LONG_SIDE)


def builtin_names() -> list[str]:
    """Built-in names for `StrokeTexture.open`, which also takes their variants ("flat_2")."""
    return [*KERNELS, *sorted(name for name in _image_names() if not _VARIANT.search(name))]


def variants_of(name: str) -> list[str]:
    """The images of a built-in stroke, itself first: ["flat", "flat_2", ...].

    A name with a number selects one ("flat_2", and "flat_1" for "flat"). Kernels have one; other names have
    none.
    """
    if Path(name).suffix or "/" in name or os.sep in name:
        return []
    name = _plain_name(name)
    names = _image_names()
    number = _VARIANT.search(name)
    if number and (name in names or int(number[1]) == 1):
        first = name if name in names else name[: number.start()]
        return [first] if first in names else []
    return [each for each in sorted([*KERNELS, *names]) if without_number(each) == name]


def without_number(name: str) -> str:
    """The stroke of a variant: "flat" for "flat_2" and "flat"."""
    return _VARIANT.sub("", name)


@cache  # a painting asks some hundred times
def _image_names() -> tuple[str, ...]:
    return tuple(path.stem for path in strokes_folder().glob("*.png"))


def _plain_name(stem: str) -> str:
    """Normalize a built-in name written with capitals, spaces or hyphens."""
    return stem.lower().replace("-", "_").replace(" ", "_")


@cache
def strokes_folder() -> Path:
    """The folder of the built-in images: inside the installed package, or beside it in a checkout."""
    package = Path(__file__).resolve().parents[1]
    installed = package / "strokes"
    return installed if installed.is_dir() else package.parent / "strokes"


def _unknown(name: str) -> str:
    names = builtin_names()
    closest = get_close_matches(name, names, n=1, cutoff=0.6)
    hint = f"; did you mean {closest[0]!r}?" if closest else ""
    return f"neither a file nor a built-in stroke, which are {', '.join(names)}{hint}"


def _coverage_and_height(
    pixels: NDArray[np.float32], path: Path
) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
    """[H, W, C], 0 to 1 -> coverage [H, W] and, if alpha is the coverage, the relief [H, W]."""
    num_channels = pixels.shape[2]
    luminance = np.empty(pixels.shape[:2], np.float32)
    for start in range(0, len(pixels), _ROWS_AT_A_TIME):  # in bands: copies of a large image take memory
        part = pixels[start : start + _ROWS_AT_A_TIME]
        color = split_alpha(part)[0].copy()
        luminance[start : start + _ROWS_AT_A_TIME] = color @ np.array(LUMINANCE, color.dtype)
    if num_channels in (2, 4) and pixels[..., -1].min() < OPAQUE:
        return np.ascontiguousarray(pixels[..., -1]), luminance
    background = np.median(_border(luminance))
    distance = background - luminance if background > 0.5 else luminance - background
    if np.ptp(luminance) < BLANK:
        sentence = "the stroke image has one flat tone and no transparency, so it paints a solid rectangle"
        warnings.warn(SceneWarning(f"{path}: {sentence}"), stacklevel=4)
        return np.ones_like(luminance), None
    if distance.max() < BLANK:  # a mid-gray border: the paint differs in the other direction
        distance = -distance
    coverage = np.clip(distance / distance.max(), 0, 1)
    coverage = np.where(coverage < BLANK, np.float32(0), coverage).astype(np.float32)
    if _border(coverage).mean() > MOST_ON_BORDER:
        fact = "the stroke image has no empty margin, so strokes end in straight cuts"
        cure = "leave a margin of one tone around the paint, or cut it out with transparency"
        warnings.warn(SceneWarning(f"{path}: {fact}; {cure}"), stacklevel=4)
    return coverage, None


def _tint_of(
    pixels: NDArray[np.float32], coverage: NDArray[np.float32], small: NDArray[np.uint8]
) -> Tint | None:
    """The colors of an image, averaged over its paint to the texels of its coverage; None if gray."""
    if pixels.shape[2] < 3:
        return None
    paint = coverage[..., None]
    weights = np.maximum(_average(coverage, small.shape), 1e-6)[..., None]
    rgb = np.stack(
        [_average((pixels[..., c : c + 1] * paint)[..., 0], small.shape) for c in range(3)], axis=-1
    )
    rgb = np.clip(rgb / weights, 0, 1)
    return Tint.of(rgb, small) if np.ptp(rgb, axis=2)[small > 0].max() > GREY else None


def _border(image: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]])


def brush_of_style(name: str) -> tuple[Path, int | None] | None:
    """Style file and brush number of a name such as "monet.style:2"; None for other names.

    The number is None if the name is only a style.
    """
    if found := _OF_STYLE.fullmatch(name):
        return Path(found["file"]), int(found["number"])
    return (Path(name), None) if name.lower().endswith(STYLE_SUFFIX) else None


def name_in_style(path: Path, number: int | None) -> str:
    """A file-safe name for a brush of a style: "monet_2"."""
    return path.stem if number is None else f"{path.stem}_{number}"


def _shape_within(shape: Sequence[int], size: int) -> list[int]:
    """The shape of an image scaled to a longest side of at most `size` texels."""
    factor = min(1.0, size / max(shape))
    return [max(1, round(n * factor)) for n in shape]


def _average(image: NDArray[np.float32], shape: Sequence[int]) -> NDArray[np.float32]:
    """Area average down to `shape`: preserves the mean, without ringing."""
    for axis, size in enumerate(shape):
        if size != image.shape[axis]:
            image = np.moveaxis(_means_of_parts(np.moveaxis(image, axis, 0), size), 0, axis)
    return np.ascontiguousarray(image)


def _means_of_parts(image: NDArray[np.float32], size: int) -> NDArray[np.float32]:
    """[size, W] means over `size` equal parts of the rows of an image; parts may split rows.

    The first rows of all parts are added together, then the second ones, and so on, which avoids a large
    weight matrix for long, thin pictures.
    """
    ends = np.linspace(0, len(image), size + 1)
    start, stop = ends[:-1], ends[1:]
    first = np.floor(start).astype(np.intp)
    means = np.zeros((size, *image.shape[1:]), np.float32)
    for step in range(int(np.max(np.ceil(stop) - first))):
        row = first + step
        weights = np.clip((np.minimum(row + 1, stop) - np.maximum(row, start)) / (stop - start), 0, None)
        means += weights.astype(np.float32)[:, None] * image[np.minimum(row, len(image) - 1)]
    return means
