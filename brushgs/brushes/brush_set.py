"""Several stroke images in one picture: which brush a stroke is painted with is a row of a `BrushSet`.

The row stands in the column `brushes` of the strokes, which `choose_brushes` fills once for a job: a
stroke keeps its brush in every view.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.texture import LONG_SIDE, StrokeTexture, brush_of_style, name_in_style, variants_of
from brushgs.errors import SceneError
from brushgs.formats.files import exists, is_dir, is_plain

MOST_BRUSHES = 256  # a row is a byte
IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".webp", ".exr")  # of brushes in a folder
# Side of a picture from which on brushes are opened with twice the texels: in one of 3840 px strokes are 60
# to 300 px long, and 256 texels would look soft in the largest.
LARGE_PICTURE = 2000

Sigmas = float | tuple[float, ...]  # standard deviations: one number for all brushes, or one for each


@dataclass(frozen=True, eq=False)
class BrushSet:
    """The brushes that a picture is painted with.

    Attributes:
        textures: 1 to 256 stroke images; or one built-in kernel, alone.
        name: for reports and the names of files.

    Raises:
        TypeError: if one is no `StrokeTexture`.
        ValueError: if there are none, more than 256, or a built-in kernel among several.
    """

    textures: tuple[StrokeTexture, ...]
    name: str = ""

    def __post_init__(self) -> None:
        textures = tuple(self.textures)
        for texture in textures:
            if not isinstance(texture, StrokeTexture):
                raise TypeError(f"BrushSet: textures must be StrokeTexture, got {type(texture).__name__}")
        check_count(len(textures))
        kernel = next((texture for texture in textures if texture.kind != "image"), None)
        if kernel is not None and len(textures) > 1:
            raise ValueError(
                f"BrushSet: {kernel.name!r} is computed and not drawn, so it must be the only brush; "
                "omit it or paint with it alone"
            )
        object.__setattr__(self, "textures", textures)
        object.__setattr__(self, "name", self.name or joined_name([texture.name for texture in textures]))

    def __len__(self) -> int:
        return len(self.textures)

    def __repr__(self) -> str:
        return f"BrushSet({', '.join(self.names)})"

    @property
    def kind(self) -> str:
        """That of its textures: "image", "gaussian" or "ellipse"."""
        return self.textures[0].kind

    @property
    def is_directed(self) -> bool:
        """Whether its brushes have a direction, see `StrokeTexture.is_directed`."""
        return self.textures[0].is_directed

    @property
    def names(self) -> tuple[str, ...]:
        """Of the brushes, by row."""
        return tuple(texture.name for texture in self.textures)

    @property
    def coverages(self) -> tuple[NDArray[np.uint8], ...]:
        """Of the brushes, by row."""
        return tuple(texture.coverage for texture in self.textures)

    @property
    def are_colored(self) -> bool:
        """Whether a brush has colours of its own."""
        return any(texture.tint is not None for texture in self.textures)

    def without_colors(self) -> "BrushSet":
        """The same brushes without colours of their own."""
        if not self.are_colored:
            return self
        return BrushSet(tuple(replace(texture, tint=None) for texture in self.textures), self.name)

    @property
    def num_sigmas(self) -> Sigmas:
        """Half length of a box in standard deviations, of all brushes or of each; see `StrokeTexture`."""
        return _common([texture.num_sigmas for texture in self.textures])

    @property
    def fitted_sigmas(self) -> Sigmas:
        """The same for about as much paint as the Gaussians have, see `StrokeTexture.fitted_sigmas`."""
        return _common([texture.fitted_sigmas for texture in self.textures])

    def rows_of(self, where: str, brushes: NDArray[np.uint8] | None) -> NDArray[np.uint8] | None:
        """The column `brushes` as it chooses from this set: None where one brush serves all.

        Args:
            where: name of the function that asks, for the message.
            brushes: [N] or [M] of strokes or boxes.

        Raises:
            ValueError: if a row lies beyond the set. A built-in kernel serves any.
        """
        if brushes is None or self.kind != "image":
            return None
        check_brushes(where, brushes, len(self))
        return brushes if len(self) > 1 else None

    def without_bristles(self, brushes: NDArray[np.uint8] | None) -> NDArray[np.bool_] | None:
        """[M] mask of the boxes that bristles leave no streaks in; None where there is none."""
        smooth = [row for row, texture in enumerate(self.textures) if not texture.has_bristles]
        return np.isin(brushes, smooth) if smooth and brushes is not None else None

    @classmethod
    def open(
        cls, stroke: str | Path | Sequence[str | Path], *, size: int = LONG_SIDE, colored: bool = False
    ) -> "BrushSet":
        """The brush or the brushes that names, files or a folder give.

        Args:
            stroke: what `StrokeTexture.open` takes; several of these, as a list or with commas between them
                ("flat,dab", "a.png,b.png"); or a folder, whose images by name are the set. A file whose name
                has a comma in it is one brush.
            size: longest side kept of each image, texels.
            colored: whether images with colour in them keep it, see `StrokeTexture.open`.

        Raises:
            SceneError: if one cannot be opened, or a folder holds no image.
            ValueError: if there are more than 256, or a built-in kernel among several.

        Example:
            >>> bg.BrushSet.open("flat,dab")
            BrushSet(flat, dab)
        """
        paths = paths_of(stroke) if isinstance(stroke, str | Path) else list(stroke)
        check_count(len(paths))  # before they are all read
        textures = tuple(StrokeTexture.open(path, size=size, colored=colored) for path in paths)
        if isinstance(stroke, str | Path) and is_folder(stroke):
            return cls(textures, name_of(stroke))
        return cls(textures)

    @classmethod
    def of(cls, stroke: Any) -> "BrushSet":
        """The set itself, or that of a texture, a name, a path or several of these: what `render` takes.

        Raises:
            TypeError: if it is something else.
            SceneError: see `open`.
        """
        if isinstance(stroke, cls):
            return stroke
        if isinstance(stroke, StrokeTexture | np.ndarray):
            return cls((StrokeTexture.of(stroke),))
        if isinstance(stroke, str | Path):
            return cls.open(stroke)
        if isinstance(stroke, Sequence) and stroke:
            return cls(tuple(StrokeTexture.of(each) for each in stroke))
        raise TypeError(
            "texture must be a StrokeTexture, a BrushSet, the name of a stroke, a path or a picture as an "
            "array, got "
            f"{type(stroke).__name__}"
        )


Brushes = BrushSet | StrokeTexture  # opened
# What painting takes: a brush, its name, path or picture, several of these, or a set.
Brush = BrushSet | StrokeTexture | NDArray[Any] | str | Path | Sequence[StrokeTexture | str | Path]


def check_count(count: int) -> None:
    """Raise ValueError if no set can have so many brushes."""
    if not 1 <= count <= MOST_BRUSHES:
        raise ValueError(f"BrushSet: a set must have 1 to {MOST_BRUSHES} brushes, got {count}; omit some")


def check_brushes(where: str, brushes: NDArray[np.uint8], count: int) -> None:
    """Raise ValueError if a row lies beyond a set of so many brushes."""
    if len(brushes) and (largest := int(brushes.max())) >= count:
        first = int(np.argmax(brushes >= count))
        have = "1 brush" if count == 1 else f"{count} brushes"
        raise ValueError(
            f"{where}: brushes must be rows of the brush set, which has {have}, got row {largest}, first one "
            f"beyond at {first}; paint with the set that they were chosen from, or choose them anew"
        )


def per_row(
    where: str, values: tuple[float, ...], brushes: NDArray[np.uint8] | None, count: int
) -> NDArray[np.float64]:
    """[count] what belongs to the brush of each row, of values by brush; the first where there is no column.

    Raises:
        ValueError: if the brush of a row has no value.
    """
    if brushes is None:
        return np.full(count, values[0])
    check_brushes(where, brushes, len(values))
    return np.array(values)[brushes]


def paths_of(stroke: str | Path) -> Sequence[str | Path]:
    """The single strokes that a text or path means: those of a list with commas, or of a folder.

    Raises:
        SceneError: if a folder holds no image, or nothing stands between two commas.
    """
    path = Path(stroke)
    if is_folder(stroke):
        images = sorted(p for p in path.iterdir() if p.suffix.lower() in IMAGE_SUFFIXES and is_plain(p))
        if not images:
            known = ", ".join(IMAGE_SUFFIXES)
            raise SceneError(path, f"the folder holds no brush; put stroke images into it ({known})")
        return images
    if not isinstance(stroke, str) or "," not in stroke or exists(path):
        return [stroke]
    parts = [part.strip() for part in stroke.split(",")]
    if not all(parts):
        raise SceneError(stroke, "nothing stands between two commas; write names or files, as in flat,dab")
    return parts


def is_folder(stroke: str | Path) -> bool:
    """Whether a text or path means the images of a folder; the name of a built-in stroke does not."""
    return is_dir(Path(stroke)) and not (isinstance(stroke, str) and variants_of(stroke))


def name_of(stroke: str | Path) -> str:
    """A name for what `BrushSet.open` takes, fit for that of a file, without reading an image.

    Raises:
        SceneError: if a folder holds no image, or nothing stands between two commas.
    """
    if is_folder(stroke):
        return Path(stroke).resolve().name
    return joined_name([_plain_name_of(path) for path in paths_of(stroke)])


def _plain_name_of(stroke: str | Path) -> str:
    of_style = brush_of_style(str(stroke))
    return Path(stroke).stem if of_style is None else name_in_style(*of_style)


def joined_name(names: Sequence[str]) -> str:
    """A name for several brushes, fit for that of a file."""
    if len(names) <= 3:
        return "-".join(names)
    return f"{names[0]}-and-{len(names) - 1}-more"


def size_for(width: int, height: int) -> int:
    """The longest side of stroke images, in texels, for a picture of so many pixels.

    256 up to 2000 px of its longer side, above that 512.
    """
    return LONG_SIDE if max(width, height) <= LARGE_PICTURE else 2 * LONG_SIDE


def _common(values: list[float]) -> Sigmas:
    return values[0] if len(set(values)) == 1 else tuple(values)
