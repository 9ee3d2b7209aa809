"""Gaussians: the columns of a scene, and of strokes in space."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import U8, Array, check
from brushgs.values.columns import RowChoice, check_finite, check_rows, freeze_columns, take_rows

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
_WITHOUT = {"brushes": 0, "ids": -1, "regions": 0}  # default of rows without the column


@dataclass(frozen=True, eq=False)
class Gaussians:
    """N anisotropic 3D Gaussians with view-dependent color: a scene, or the strokes made of one.

    All float columns share one dtype, float32 or float64, and become read-only views; contiguous arrays are
    not copied. Lists and integer arrays are converted to the dtype of the float arrays given, else to
    float32.

    `gaussians[rows]` takes an index array, a mask, a list of either or a slice; `a + b` concatenates.

    Attributes:
        means: [N, 3] centers, world units, finite.
        quats: [N, 4] rotations as w, x, y, z; any non-zero length, normalized where used.
        scales: [N, 3] standard deviations along the local axes, world units, >= 0.
        opacities: [N] 0 to 1.
        sh: [N, k, 3] spherical-harmonic coefficients of RGB, k = (degree + 1)^2 in 1, 4, 9, 16; the
            color seen is max(0, 0.5 + sum of coefficient x basis).
            Source: Kerbl et al. 2023.
        antialiased: trained with the opacity compensation of Mip-Splatting: `project` multiplies opacities by
            the root of det S / det(S + low_pass I), S the projected covariance, which fades Gaussians thinner
            than a pixel. Strokes made of them keep the flag: in five scenes that changed the PSNR to the
            plain picture by 0.0 to +3.2 dB with a flat brush, by -0.4 to +6.8 dB with the plain kernel.
            Source: Yu et al. 2024, Mip-Splatting, section 5.2.
        brushes: [N] uint8, row of each stroke's brush in a `BrushSet`; None: row 0 for all.
        ids: [N] int32, row of the same Gaussian in a `MovingScene`, or of the stroke in a `StrokeMotion` it
            moves with; -1 if it does not move. None in still scenes. `take` keeps ids.
        regions: [N] uint8, number of the rule that applies, from 1, see `brushgs.options.rules`; 0: none.
            None without rules.
        finest: >= 0, world units: standard deviation of the thinnest visible line at the distance that
            strokes are made for. Passes treat thinner Gaussians as this thin, see `brushgs.passes.finest`.
            None without a known view: passes then assume a distance of 2.4 radii. `render` ignores it.

    Raises:
        TypeError: if a column is not numeric, dtypes differ, or `brushes`, `ids` or `regions` are not
            integers.
        ValueError: if a shape is wrong or a value is out of range; names column and row.

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
    brushes: U8 | None = field(default=None, kw_only=True)  # [N]
    ids: NDArray[np.int32] | None = field(default=None, kw_only=True)  # [N]
    regions: U8 | None = field(default=None, kw_only=True)  # [N]
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
        # Row masks are built only if a cheap test of the whole column finds a fault.
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
        """The float columns by name, without `brushes`, `ids` and `regions`."""
        return {name: getattr(self, name) for name in GAUSSIAN_COLUMNS}

    def _integers(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in _GAUSSIAN_INTEGERS}

    def take(self, rows: RowChoice) -> "Gaussians":
        """The rows of an index array, a mask, a list of either or a slice, in that order.

        Raises:
            TypeError: for anything else, such as a single number.
            IndexError: if a row is out of range, or a mask has another length.
        """
        return replace(self, **take_rows("Gaussians", self.columns() | self._integers(), rows))

    def __getitem__(self, rows: RowChoice) -> "Gaussians":
        """Same as `take`."""
        return self.take(rows)

    __iter__ = None  # not iterable: Python would otherwise try [0], [1] and so on

    def __add__(self, other: "Gaussians") -> "Gaussians":
        """Concatenate without loss, `self` first.

        The result has the higher SH degree (padded with zeros) and the wider dtype. If only one side has
        `brushes` or `regions`, the other gets 0; if only one has `ids`, the other gets -1.

        Raises:
            ValueError: if only one is `antialiased`: they are drawn differently.
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
        """Concatenate parts in the SH degree, dtype and columns of the first.

        Terms above that degree are cut, missing ones are zero. Parts without brushes or regions get 0, parts
        without ids -1.

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
        """The same Gaussians with float columns as float32 or float64."""
        cast = {name: column.astype(dtype, copy=False) for name, column in self.columns().items()}
        return replace(self, **cast)


def _with_terms(sh: Array, num_terms: int) -> Array:
    """Coefficients [N, num_terms, 3]: cut, or padded with zeros."""
    missing = num_terms - sh.shape[1]
    return np.pad(sh, ((0, 0), (0, missing), (0, 0))) if missing > 0 else sh[:, :num_terms]
