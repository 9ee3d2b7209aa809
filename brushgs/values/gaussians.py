"""Gaussians: the columns of a scene, and of strokes in space."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import Array, check
from brushgs.values.columns import RowChoice, check_finite, check_rows, freeze_columns, row_choice

SH_TERMS = {1: 0, 4: 1, 9: 2, 16: 3}  # number of spherical-harmonic terms -> degree
GAUSSIAN_COLUMNS = (
    "means",
    "quats",
    "scales",
    "opacities",
    "sh",
)  # of Gaussians, in order
_GAUSSIAN_INTEGERS: dict[str, type[np.integer[Any]]] = {
    "brushes": np.uint8,
    "ids": np.int32,
    "regions": np.uint8,
}
_WITHOUT = {"brushes": 0, "ids": -1, "regions": 0}  # what rows have that come without the column


@dataclass(frozen=True, eq=False)
class Gaussians:
    """N anisotropic 3D Gaussians with view-dependent colour: a scene, or the strokes made of one.

    All columns share one dtype, float32 or float64, and become read-only views: no copy is made of arrays
    that are already contiguous. Lists, and arrays of whole numbers, are taken too, in the dtype of the arrays
    beside them, or as float32.

    `gaussians[rows]` are those of an index array, a mask, a list of either or a slice, and `a + b` is both.

    Attributes:
        means: [N, 3] centres, world units, finite.
        quats: [N, 4] rotations as w, x, y, z; any non-zero length, normalised where used.
        scales: [N, 3] standard deviations along the own axes, world units, >= 0.
        opacities: [N] 0 to 1.
        sh: [N, k, 3] spherical-harmonic coefficients of RGB, k = (degree + 1)^2 in 1, 4, 9, 16; the
            colour seen is max(0, 0.5 + sum of coefficient x basis). Source: Kerbl et al. 2023.
        antialiased: whether they were trained with the opacity compensation of Mip-Splatting: `project` then
            multiplies opacities by the root of det S / det(S + low_pass I), S the projected covariance, so
            that what is thinner than a pixel gets fainter. Strokes made of such Gaussians keep it: in five
            scenes a flat brush came 0.0 to 3.2 dB nearer to the plain picture so, the plain kernel 0.4 dB
            further away to 6.8 dB nearer. Source: Yu et al. 2024, Mip-Splatting, section 5.2.
        brushes: [N] uint8, the brush of each stroke: its row of a `BrushSet`; None: the first for all.
        ids: [N] int32, where things move: of which row of a `MovingScene` each is a moment, or which stroke
            of a `StrokeMotion` it moves with, -1 for what rests; None where nothing moves. Rows that are
            taken keep theirs.
        regions: [N] uint8, the part of the scene that each belongs to: 0 elsewhere, else the number of its
            rule, from 1, see `brushgs.options.rules`; None where all is treated alike.
        finest: >= 0, standard deviation of the finest line that pictures show from the distance that strokes
            are made for, world units: passes take thinner Gaussians for that, see `brushgs.passes.finest`.
            None where no view is known: passes then take the distance of 2.4 radii. `render` ignores it.

    Raises:
        TypeError: if a column holds no numbers, or dtypes differ; or `brushes`, `ids` or `regions` hold other
            than whole numbers.
        ValueError: if a shape is wrong or a value is outside the range above; names column and row.

    Example:
        >>> where, turned, size = [[0, 0, 0]], [[1, 0, 0, 0]], [[1, 0.2, 0.1]]
        >>> one = bg.Gaussians(where, turned, size, opacities=[0.8], sh=[[[1, 0, 0]]])
        >>> one
        Gaussians(1, SH 0)
        >>> gaussians[gaussians.opacities > 0.5] + one
        Gaussians(..., SH 3)
    """

    means: Array  # [N, 3]
    quats: Array  # [N, 4]
    scales: Array  # [N, 3]
    opacities: Array  # [N]
    sh: Array  # [N, k, 3]
    antialiased: bool = field(default=False, kw_only=True)
    brushes: NDArray[np.uint8] | None = field(default=None, kw_only=True)  # [N]
    ids: NDArray[np.int32] | None = field(default=None, kw_only=True)  # [N]
    regions: NDArray[np.uint8] | None = field(default=None, kw_only=True)  # [N]
    finest: float | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        freeze_columns("Gaussians", self, _GAUSSIAN_INTEGERS)
        sizes = check(
            "Gaussians",
            means=(self.means, "N 3"),
            quats=(self.quats, "N 4"),
            scales=(self.scales, "N 3"),
            opacities=(self.opacities, "N"),
            sh=(self.sh, "N k 3"),
            **{name: (column, "N") for name, column in self._integers().items() if column is not None},
        )
        if sizes["k"] not in SH_TERMS:
            raise ValueError(f"Gaussians: sh must have 1, 4, 9 or 16 terms, got {sizes['k']}")
        check_finite("Gaussians", self)
        # The masks of rows are made only where a cheap test of all values at once finds a fault.
        if self.scales.min(initial=0) < 0:
            check_rows("Gaussians", "scales", "be >= 0", np.any(self.scales < 0, axis=1))
        outside = (self.opacities < 0) | (self.opacities > 1)
        check_rows("Gaussians", "opacities", "lie in 0 to 1 (decoded, not logits)", outside)
        if self.finest is not None and not 0 <= self.finest < np.inf:
            raise ValueError(f"Gaussians: finest must be >= 0 and finite, got {self.finest}")
        if not self.quats[:, 0].all():
            check_rows("Gaussians", "quats", "have a length above zero", np.asarray(~self.quats.any(axis=1)))

    def __len__(self) -> int:
        return len(self.means)

    @property
    def sh_degree(self) -> int:
        """Degree of the spherical harmonics, 0 to 3."""
        return SH_TERMS[self.sh.shape[1]]

    def columns(self) -> dict[str, Any]:
        """The columns of numbers by name; `brushes`, `ids` and `regions` are not among them."""
        return {name: getattr(self, name) for name in GAUSSIAN_COLUMNS}

    def _integers(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in _GAUSSIAN_INTEGERS}

    def take(self, rows: RowChoice) -> "Gaussians":
        """The rows chosen by an index array, a mask, a list of either or a slice, in that order.

        Raises:
            TypeError: if it is something else, such as a single number, which would leave no table.
            IndexError: if a row lies beyond the last, or a mask has another length.
        """
        chosen = row_choice("Gaussians", rows)
        columns = self.columns() | self._integers()
        taken: dict[str, Any] = {name: c if c is None else c[chosen] for name, c in columns.items()}
        return replace(self, **taken)

    def __getitem__(self, rows: RowChoice) -> "Gaussians":
        """`take`."""
        return self.take(rows)

    __iter__ = None  # a row alone is no value here; without this Python would try [0], [1] and so on

    def __add__(self, other: "Gaussians") -> "Gaussians":
        """Both, these first, with nothing lost.

        Spherical harmonics are of the higher degree, filled up with zeros, and the dtype is the wider one.
        Where one alone has `brushes` or `regions`, the others take the first brush and lie elsewhere (0);
        where one alone has `ids`, the others rest (-1).

        Raises:
            ValueError: if one was trained `antialiased` and the other was not: they are drawn in two ways.
        """
        if not isinstance(other, Gaussians):
            return NotImplemented
        if self.antialiased != other.antialiased:
            raise ValueError(
                "Gaussians: both must be antialiased, or neither; set it with dataclasses.replace"
            )
        return Gaussians.joined([self._in_the_form_of(other), other])

    def _in_the_form_of(self, other: "Gaussians") -> "Gaussians":
        """The same with the wider dtype, the higher SH degree and the columns of both."""
        columns: dict[str, Any] = self.astype(np.result_type(self.means, other.means).type).columns()
        columns["sh"] = _with_terms(columns["sh"], max(self.sh.shape[1], other.sh.shape[1]))
        for name, dtype in _GAUSSIAN_INTEGERS.items():
            if getattr(self, name) is None and getattr(other, name) is not None:
                columns[name] = np.full(len(self), _WITHOUT[name], dtype)
        return replace(self, **columns)

    def __repr__(self) -> str:
        facts = [f"{len(self):,}", f"SH {self.sh_degree}"]
        facts += ["float64"] if self.means.dtype == np.float64 else []
        facts += ["antialiased"] if self.antialiased else []
        facts += [name for name, column in self._integers().items() if column is not None]
        return f"Gaussians({', '.join(facts)})"

    @staticmethod
    def joined(parts: "Sequence[Gaussians]") -> "Gaussians":
        """Several behind each other, with the SH degree, the dtype and the columns of the first.

        Terms above that degree are cut, those that a part lacks are zero. Parts without brushes or regions
        have 0 there, parts without ids -1.

        Args:
            parts: at least one.
        """
        first, num_terms = parts[0], parts[0].sh.shape[1]
        columns: dict[str, Any] = {}
        for name, column in (first.columns() | first._integers()).items():
            if column is None:
                columns[name] = None
                continue
            others = [getattr(part, name) for part in parts[1:]]
            if name == "sh":
                others = [_with_terms(other, num_terms) for other in others]
            others = [
                np.full(len(part), _WITHOUT[name], column.dtype)
                if other is None
                else other.astype(column.dtype, copy=False)
                for part, other in zip(parts[1:], others, strict=True)
            ]
            columns[name] = np.concatenate([column, *others])
        return replace(first, **columns)

    def astype(self, dtype: type[np.floating[Any]]) -> "Gaussians":
        """The same Gaussians with all columns of numbers as float32 or float64."""
        cast = {name: column.astype(dtype, copy=False) for name, column in self.columns().items()}
        return replace(self, **cast)


def _with_terms(sh: Array, num_terms: int) -> Array:
    """Coefficients [N, k, 3] with so many terms: cut, or filled with zeros."""
    missing = num_terms - sh.shape[1]
    return np.pad(sh, ((0, 0), (0, missing), (0, 0))) if missing > 0 else sh[:, :num_terms]
