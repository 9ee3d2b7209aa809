"""Overpaint: marks that a user painted over a scene in space, and edits of the strokes below them.

Stored as a file, see `formats.marks`. Overpaint belongs to the scene, not to strokes, so it stays when
strokes are made again. Colors are display-encoded RGB, 0 to 1; lengths are in world units; directions and
normals are unit vectors in world axes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import reduce
from operator import add
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import F64, U8

MOST_ROWS = 1 << 14  # marks of a file, and patches of each kind
MOST_TILE = 256  # texels per side of a tile
NO_TILE = -1
UNIT = 1e-3  # tolerance of the length of unit vectors
MOST = 1e15  # world units, as for positions of cameras
P = TypeVar("P", bound="Patches")


@dataclass(frozen=True, eq=False)
class Patches:
    """Base class: N places of a scene, with a column for each property.

    Attributes:
        means: [N, 3] centers.

    Raises:
        ValueError: if a shape is wrong or a value is out of its range; names the column.
    """

    # Column -> trailing shape, least and most value; None for unit vectors.
    COLUMNS: ClassVar[dict[str, tuple[tuple[int, ...], tuple[float, float] | None]]] = {
        "means": ((3,), (-MOST, MOST))
    }
    OPTIONAL: ClassVar[tuple[str, ...]] = ()  # columns that files may lack
    means: F64

    def __post_init__(self) -> None:
        for name, (shape, limits) in self.COLUMNS.items():
            column = np.asarray(getattr(self, name), np.float64)
            if column.shape != (len(self.means), *shape):
                raise ValueError(f"{name} must have shape {[len(self.means), *shape]}, got {[*column.shape]}")
            if limits is None:
                lengths = np.linalg.norm(column, axis=1)
                if not (np.abs(lengths - 1) <= UNIT).all():
                    raise ValueError(f"{name} must be unit vectors")
                column = column / lengths[:, None]
            elif not ((column >= limits[0]) & (column <= limits[1])).all():
                raise ValueError(f"{name} must lie in {limits[0]:g} to {limits[1]:g}")
            object.__setattr__(self, name, column)

    def __len__(self) -> int:
        return len(self.means)

    def take(self: P, rows: NDArray[Any]) -> P:
        """The rows chosen by an index array or a mask, in that order."""
        return replace(self, **{name: getattr(self, name)[rows] for name in self.COLUMNS})

    def __add__(self: P, other: P) -> P:
        """Concatenate, `self` first."""
        columns = ((name, (getattr(self, name), getattr(other, name))) for name in self.COLUMNS)
        return replace(self, **{name: np.concatenate(both) for name, both in columns})


@dataclass(frozen=True, eq=False)
class Marks(Patches):
    """N marks: flat rectangles in space that lie on the surface.

    If two overlap on a surface, the one of the higher layer covers the other; otherwise the nearer one does.

    Attributes:
        means: [N, 3] centers.
        directions: [N, 3] long axis of each mark: the u axis of its tile.
        normals: [N, 3] of its plane, toward the viewer, perpendicular to `directions`; the v axis is
            direction x normal.
        lengths: [N] along the direction, > 0.
        widths: [N] across it, > 0.
        colors: [N, 3] of marks without a tile; for others the mean of the tile.
        opacities: [N] 0 to 1, multiplied by the alpha of the tile.
        tiles: [N] index into `images` of the picture of each mark; `NO_TILE` for the brush of the painting.
        images: uint8 [h, w, 4] each, red, green, blue and straight alpha.
        layers: [N] whole numbers; higher ones are laid later. None: 0 for all.
    """

    COLUMNS: ClassVar = Patches.COLUMNS | {
        "directions": ((3,), None),
        "normals": ((3,), None),
        "lengths": ((), (1e-12, MOST)),
        "widths": ((), (1e-12, MOST)),
        "colors": ((3,), (0, 1)),
        "opacities": ((), (0, 1)),
        "tiles": ((), (NO_TILE, MOST_ROWS)),
        "layers": ((), (0, MOST_ROWS)),
    }
    OPTIONAL: ClassVar = ("layers",)
    directions: F64
    normals: F64
    lengths: F64
    widths: F64
    colors: F64
    opacities: F64
    tiles: NDArray[np.intp]
    images: tuple[U8, ...] = ()
    layers: NDArray[np.intp] = None  # type: ignore[assignment]  # 0 for all

    def __post_init__(self) -> None:
        if self.layers is None:
            object.__setattr__(self, "layers", np.zeros(len(self.means), np.intp))
        super().__post_init__()
        if (self.layers != np.rint(self.layers)).any():
            raise ValueError("layers must be whole numbers")
        object.__setattr__(self, "layers", self.layers.astype(np.intp))
        if (self.tiles != np.rint(self.tiles)).any() or self.tiles.max(initial=NO_TILE) >= len(self.images):
            raise ValueError(f"tiles must be rows of images, {NO_TILE} for none")
        object.__setattr__(self, "tiles", self.tiles.astype(np.intp))
        if (np.abs((self.normals * self.directions).sum(axis=1)) > 2 * UNIT).any():
            raise ValueError("normals must be perpendicular to directions")
        for image in self.images:
            if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 4 or not image.size > 0:
                raise ValueError("images must be uint8 [h, w, 4]")
            if max(image.shape) > MOST_TILE:
                raise ValueError(f"images must have at most {MOST_TILE} texels a side")

    def __add__(self, other: "Marks") -> "Marks":
        """Concatenate, with `self` first and in the lower layers, and the images of both."""
        shifted = np.where(other.tiles == NO_TILE, NO_TILE, other.tiles + len(self.images))
        images = self.images + other.images
        layers = np.unique(self.layers, return_inverse=True)[1]
        above = np.unique(other.layers, return_inverse=True)[1] + layers.max(initial=-1) + 1
        return super(Marks, replace(self, images=images, layers=layers)).__add__(
            replace(other, tiles=shifted, images=images, layers=above)
        )


@dataclass(frozen=True, eq=False)
class Erased(Patches):
    """N discs of a surface on which strokes of the scene are erased.

    Attributes:
        means: [N, 3] centers.
        normals: [N, 3] of the surface, toward the side from which it was erased.
        radii: [N] > 0.
    """

    COLUMNS: ClassVar = Patches.COLUMNS | {"normals": ((3,), None), "radii": ((), (1e-12, MOST))}
    normals: F64
    radii: F64


@dataclass(frozen=True, eq=False)
class Combs(Patches):
    """N balls in which strokes of the scene are turned.

    Attributes:
        means: [N, 3] centers.
        radii: [N] > 0.
        directions: [N, 3] target direction of strokes; the sign does not matter.
        strengths: [N] 0 (not at all) to 1.
    """

    COLUMNS: ClassVar = Patches.COLUMNS | {
        "radii": ((), (1e-12, MOST)),
        "directions": ((3,), None),
        "strengths": ((), (0, 1)),
    }
    radii: F64
    directions: F64
    strengths: F64


@dataclass(frozen=True, eq=False)
class Density(Patches):
    """N balls with more or fewer strokes.

    Attributes:
        means: [N, 3] centers.
        radii: [N] > 0.
        factors: [N] on the number of strokes per area, 0 (none) to 100.
    """

    COLUMNS: ClassVar = Patches.COLUMNS | {"radii": ((), (1e-12, MOST)), "factors": ((), (0, 100))}
    radii: F64
    factors: F64


@dataclass(frozen=True, eq=False)
class Overpaint:
    """All overpaint of a scene; each kind is None if there is none.

    Attributes:
        marks: paint on top of the strokes.
        erased: where strokes are erased.
        combs: where strokes are turned.
        density: where strokes are more or less dense.
        time: moment of a moving scene that was painted over, seconds; None for a still scene.
    """

    marks: Marks | None = None
    erased: Erased | None = None
    combs: Combs | None = None
    density: Density | None = None
    time: float | None = None

    @staticmethod
    def joined(parts: "Sequence[Overpaint]") -> "Overpaint":
        """Concatenate overpaint; the time is that of the first part that has one.

        Args:
            parts: any number.
        """
        found: dict[str, Any] = {}
        for field in fields(Overpaint):
            given = [value for part in parts if (value := getattr(part, field.name)) is not None]
            if given:
                found[field.name] = given[0] if field.name == "time" else reduce(add, given)
        return Overpaint(**found)
