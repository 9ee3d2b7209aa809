"""Several brushes in one picture: a `BrushSet`.

The column `brushes` of strokes holds the row of each stroke's brush. `choose_brushes` fills it once for a
job, so a stroke keeps its brush in every view.
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
IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".webp", ".exr")  # of brush images in a folder
# Longest picture side up to which 256 texels per brush suffice; above it brushes have twice as many: at 3840
# px strokes are 60 to 300 px long, and 256 texels would look soft.
LARGE_PICTURE = 2000

Sigmas = float | tuple[float, ...]  # standard deviations, for all brushes or for each


@dataclass(frozen=True, eq=False)
class BrushSet:
    """The brushes of a picture.

    Attributes:
        textures: 1 to 256 stroke images; or a single built-in kernel.
        name: for reports and file names.

    Raises:
        TypeError: if a texture is not a `StrokeTexture`.
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
        """Kind of its textures: "image", "gaussian" or "ellipse"."""
        return self.textures[0].kind

    @property
    def is_directed(self) -> bool:
        """Whether its brushes have a direction, see `StrokeTexture.is_directed`."""
        return self.textures[0].is_directed

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the brushes, by row."""
        return tuple(texture.name for texture in self.textures)

    @property
    def coverages(self) -> tuple[NDArray[np.uint8], ...]:
        """Coverages of the brushes, by row."""
        return tuple(texture.coverage for texture in self.textures)

    @property
    def are_colored(self) -> bool:
        """Whether a brush has colors of its own."""
        return any(texture.tint is not None for texture in self.textures)

    def without_colors(self) -> "BrushSet":
        """The same brushes without colors of their own."""
        if not self.are_colored:
            return self
        return BrushSet(tuple(replace(texture, tint=None) for texture in self.textures), self.name)

    @property
    def num_sigmas(self) -> Sigmas:
        """Half length of a box in standard deviations, of all brushes or of each; see `StrokeTexture`."""
        return _common([texture.num_sigmas for texture in self.textures])

    @property
    def fitted_sigmas(self) -> Sigmas:
        """Half length fitted to the painted area of a Gaussian, see `StrokeTexture.fitted_sigmas`."""
        return _common([texture.fitted_sigmas for texture in self.textures])

    def rows_of(self, where: str, brushes: NDArray[np.uint8] | None) -> NDArray[np.uint8] | None:
        """The column `brushes` checked against this set; None if one brush serves all.

        Args:
            where: name of the calling function, for the message.
            brushes: [N] or [M] of strokes or boxes.

        Raises:
            ValueError: if a row is beyond the set. A built-in kernel accepts any row.
        """
        if brushes is None or self.kind != "image":
            return None
        check_brushes(where, brushes, len(self))
        return brushes if len(self) > 1 else None

    def without_bristles(self, brushes: NDArray[np.uint8] | None) -> NDArray[np.bool_] | None:
        """[M] mask of boxes whose brush has no bristle streaks; None if there are none."""
        smooth = [row for row, texture in enumerate(self.textures) if not texture.has_bristles]
        return np.isin(brushes, smooth) if smooth and brushes is not None else None

    @classmethod
    def open(
        cls, stroke: str | Path | Sequence[str | Path], *, size: int = LONG_SIDE, colored: bool = False
    ) -> "BrushSet":
        """Open one or several brushes by names, files or a folder.

        Args:
            stroke: as for `StrokeTexture.open`; several of these, as a list or separated by commas
                ("flat,dab", "a.png,b.png"); or a folder, whose images sorted by name are the set. An existing
                file with a comma in its name is one brush.
            size: longest side kept of each image, texels.
            colored: whether images with color in them keep it, see `StrokeTexture.open`.

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
        """A set from a set, a texture, a name, a path or several of these, as taken by `render`.

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
# A brush argument: a texture, its name, path or picture, several of these, or a set.
Brush = BrushSet | StrokeTexture | NDArray[Any] | str | Path | Sequence[StrokeTexture | str | Path]


def check_count(count: int) -> None:
    """Raise ValueError if a set cannot have this many brushes."""
    if not 1 <= count <= MOST_BRUSHES:
        raise ValueError(f"BrushSet: a set must have 1 to {MOST_BRUSHES} brushes, got {count}; omit some")


def check_brushes(where: str, brushes: NDArray[np.uint8], count: int) -> None:
    """Raise ValueError if a row is beyond a set of `count` brushes."""
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
    """[count] the value of each row's brush; the first value if `brushes` is None.

    Raises:
        ValueError: if a brush has no value.
    """
    if brushes is None:
        return np.full(count, values[0])
    check_brushes(where, brushes, len(values))
    return np.array(values)[brushes]


def paths_of(stroke: str | Path) -> Sequence[str | Path]:
    """The single brushes of a text or path: a list with commas, or a folder.

    Raises:
        SceneError: if a folder holds no image, or an entry of the list is empty.
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
        raise SceneError(stroke, "a name is missing between two commas; write names or files, as in flat,dab")
    return parts


def is_folder(stroke: str | Path) -> bool:
    """Whether a text or path is a folder of images; built-in names are not."""
    return is_dir(Path(stroke)) and not (isinstance(stroke, str) and variants_of(stroke))


def name_of(stroke: str | Path) -> str:
    """A file-safe name for an argument of `BrushSet.open`, without reading images.

    Raises:
        SceneError: if a folder holds no image, or an entry of the list is empty.
    """
    if is_folder(stroke):
        return Path(stroke).resolve().name
    return joined_name([_plain_name_of(path) for path in paths_of(stroke)])


def _plain_name_of(stroke: str | Path) -> str:
    of_style = brush_of_style(str(stroke))
    return Path(stroke).stem if of_style is None else name_in_style(*of_style)


def joined_name(names: Sequence[str]) -> str:
    """A file-safe name for several brushes."""
    if len(names) <= 3:
        return "-".join(names)
    return f"{names[0]}-and-{len(names) - 1}-more"


def size_for(width: int, height: int) -> int:
    """Longest side of brush images in texels: 256 for pictures up to 2000 px on the longer side, else 512."""
    return LONG_SIDE if max(width, height) <= LARGE_PICTURE else 2 * LONG_SIDE


def _common(values: list[float]) -> Sigmas:
    return values[0] if len(set(values)) == 1 else tuple(values)
