"""Boxes: strokes projected to the image plane."""

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import U8, Array, check
from brushgs.values.columns import RowChoice, check_finite, check_rows, freeze_columns, take_rows

# Layers of a frame beside its color: field of `Frame` -> column of `Boxes`, [M] or [M, channels]. A layer is
# the alpha-weighted mean of its column; boxes without the column give frames without the layer. The core's
# limit of channels stands in core/include/brushgs/layers.hpp.
LAYER_COLUMNS = {"depth": "depths"}
_OPTIONAL = {"softness": "M", "setbacks": "M", "reliefs": "M 2"}  # columns of Boxes, >= 0 -> shape
_BOX_INTEGERS: dict[str, type[np.integer[Any]]] = {"ids": np.int32, "brushes": np.uint8}


@dataclass(frozen=True, eq=False)
class Boxes:
    """M oriented rectangles on the image plane, one per stroke, nearest first.

    Columns are float32 or float64 arrays (`ids` int32, `brushes` uint8), or lists of numbers; see
    `Gaussians`.

    Attributes:
        centers: [M, 2] (x, y), pixels.
        half_extents: [M, 2] (along u, along v), pixels, >= 0.
        angles: [M] direction of the u axis, radians from +x towards +y; v = (-sin, cos).
        depths: [M] camera z of the center, world units, ascending.
        colors: [M, 3] RGB, >= 0, display-encoded.
        opacities: [M] 0 to 1.
        ids: [M] int32, the Gaussian (row) behind each box.
        softness: [M] world units, >= 0, or None. Two boxes at depths closer than the root of the sum of their
            squared softness hide each other in part, see `rasterize`; None: 0 for all.
        setbacks: [M] world units, >= 0: distance of the underpaint behind its stroke, see `rasterize`; None:
            no underpaint.
        brushes: [M] uint8, row of each box's brush in a `BrushSet`; None: row 0 for all.
        reliefs: [M, 2] pixels, >= 0: thickness of the stroke's paint, and factor of the brush height minus
            1/2, see `rasterize`; None: no relief.

    Raises:
        TypeError: if a column has another dtype.
        ValueError: if a shape is wrong, depths are not ascending, or a softness, setback or relief is
            negative.

    Example:
        >>> boxes = bg.project(strokes, camera)
        >>> nearest = boxes[:100]
        >>> nearest.centers.shape
        (100, 2)
    """

    centers: Array  # [M, 2]
    half_extents: Array  # [M, 2]
    angles: Array  # [M]
    depths: Array  # [M]
    colors: Array  # [M, 3]
    opacities: Array  # [M]
    ids: NDArray[np.int32]  # [M]
    softness: Array | None = None  # [M]
    setbacks: Array | None = None  # [M]
    brushes: U8 | None = None  # [M]
    reliefs: Array | None = None  # [M, 2]

    def __post_init__(self) -> None:
        freeze_columns("Boxes", self, _BOX_INTEGERS)
        check(
            "Boxes",
            centers=(self.centers, "M 2"),
            half_extents=(self.half_extents, "M 2"),
            angles=(self.angles, "M"),
            depths=(self.depths, "M"),
            colors=(self.colors, "M 3"),
            opacities=(self.opacities, "M"),
            ids=(self.ids, "M"),
            **{name: (column, _OPTIONAL[name]) for name, column in self._optional().items()},
            **({} if self.brushes is None else {"brushes": (self.brushes, "M")}),
        )
        check_finite("Boxes", self)
        check_rows("Boxes", "depths", "ascend: sort by depth", np.diff(self.depths) < 0)
        for name, column in self._optional().items():
            if column.min(initial=0) < 0:
                check_rows("Boxes", name, "be >= 0", np.any(column.reshape(len(self), -1) < 0, axis=1))

    def __len__(self) -> int:
        return len(self.centers)

    def _optional(self) -> dict[str, Array]:
        columns = {name: getattr(self, name) for name in _OPTIONAL}
        return {name: column for name, column in columns.items() if column is not None}

    def attributes(self) -> dict[str, Array]:
        """Columns that become layers of a frame, by layer name; see `LAYER_COLUMNS`."""
        columns = {name: getattr(self, column) for name, column in LAYER_COLUMNS.items()}
        return {name: column for name, column in columns.items() if column is not None}

    def columns_of(self, rows: RowChoice) -> dict[str, Any]:
        """Rows of every column, by its name, chosen as in `Gaussians.take`; None for those that are None."""
        return take_rows("Boxes", {f.name: getattr(self, f.name) for f in fields(self)}, rows)

    def take(self, rows: RowChoice) -> "Boxes":
        """Rows chosen as in `Gaussians.take`; their order must keep depths ascending."""
        return Boxes(**self.columns_of(rows))

    def __getitem__(self, rows: RowChoice) -> "Boxes":
        """Same as `take`."""
        return self.take(rows)

    __iter__ = None  # as of Gaussians

    def __repr__(self) -> str:
        facts = [f"{len(self):,}"] + (["float64"] if self.centers.dtype == np.float64 else [])
        facts += [*self._optional()] + ([] if self.brushes is None else ["brushes"])
        return f"Boxes({', '.join(facts)})"

    def astype(self, dtype: type[np.floating[Any]]) -> "Boxes":
        """The same boxes with all columns but `ids` and `brushes` as float32 or float64."""
        floats = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in _BOX_INTEGERS}
        cast: dict[str, Any] = {n: c if c is None else c.astype(dtype, copy=False) for n, c in floats.items()}
        return replace(self, **cast)
