"""The columns into which a scene file is read, and the encoding of their numbers.

Some exporters store scales and opacities directly instead of their logarithms and logits, rotations as
x, y, z, w, or plain RGB instead of spherical harmonics. The file does not state this: the caller must, or
`brushgs doctor` detects it from the numbers. Bands of spherical harmonics that are zero in every row are not
loaded, which changes no picture. Rows that cannot be drawn are dropped and reported in one warning; a
view-dependent color coefficient that is not finite counts as 0 and its row is kept.
"""

import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields
from itertools import chain
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError, SceneWarning
from brushgs.values.arrays import F32, U8, Array, Mask
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0

Scales = Literal["log", "linear"]
Opacities = Literal["logit", "linear", "byte"]
Quats = Literal["wxyz", "xyzw"]
Colors = Literal["sh", "rgb", "byte"]
_WORDS = {"scales": Scales, "opacities": Opacities, "quats": Quats, "colors": Colors}


@dataclass(frozen=True)
class Encoding:
    """The encoding of the columns of a file. The defaults are the standard layout, which trainers write.

    Attributes:
        scales: "log" for natural logarithms, "linear" for standard deviations in world units.
        opacities: "logit", "linear" for 0 to 1, "byte" for 0 to 255.
        quats: the order of rot_0 to rot_3.
        colors: what f_dc holds: "sh" for coefficients, "rgb" for display-encoded 0 to 1, "byte" for 0 to 255.

    Raises:
        ValueError: if a value is none of these.
    """

    scales: Scales = "log"
    opacities: Opacities = "logit"
    quats: Quats = "wxyz"
    colors: Colors = "sh"

    def __post_init__(self) -> None:
        for name, words in _WORDS.items():
            value, known = getattr(self, name), get_args(words)
            if value not in known:
                raise ValueError(f"Encoding: {name} must be one of {', '.join(known)}, got {value!r}")

    @property
    def is_standard(self) -> bool:
        """Whether this is the standard layout."""
        return self == STANDARD


STANDARD = Encoding()
Reading = Encoding  # the former public name, kept for callers


# Rounding may raise an opacity of 1 by up to this; larger values are no opacities.
OPACITY_SLACK = 1e-3
# A scene in memory takes 4 bytes a number; a large file with less than 1 byte a number is bad or malicious.
_MAX_GROWTH, _SMALL_SCENE = 4, 64 << 20


@dataclass
class Columns:
    """Arrays of n rows to be filled; scales and opacities are logs and logits until `activate`."""

    means: F32  # [n, 3]
    quats: F32  # [n, 4]
    scales: F32  # [n, 3]
    opacities: F32  # [n]
    sh: F32  # [n, k, 3]
    brushes: U8 | None = None  # [n]

    @classmethod
    def empty(cls, num_rows: int, num_terms: int, *, has_brushes: bool = False) -> "Columns":
        """Uninitialised columns of `num_rows` rows with `num_terms` spherical-harmonic terms."""
        shapes = (3,), (4,), (3,), (), (num_terms, 3)
        columns = cls(*(np.empty((num_rows, *shape), np.float32) for shape in shapes))
        columns.brushes = np.empty(num_rows, np.uint8) if has_brushes else None
        return columns

    def _present(self) -> dict[str, NDArray[Any]]:
        """The columns that are not None, by name."""
        columns = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: column for name, column in columns.items() if column is not None}

    @classmethod
    def joined(cls, parts: "list[Columns]") -> "Columns":
        """The rows of all parts in order, with the largest number of spherical-harmonic terms of any part.

        The parts are emptied column by column, so that little more than the scene is in memory at once.
        Brushes are dropped, since parts number them differently.
        """
        if len(parts) == 1:
            return parts[0]
        num_rows, num_terms = sum(len(p.means) for p in parts), max(p.sh.shape[1] for p in parts)
        whole = cls.empty(num_rows, num_terms)
        for name, column in whole._present().items():
            start = 0
            for part in parts:
                values = getattr(part, name)
                rows = column[start : start + len(values)]
                if values.ndim == 3:  # pad a part of lower degree with zeros
                    rows[:, values.shape[1] :] = 0
                    rows = rows[:, : values.shape[1]]
                rows[:] = values
                start += len(values)
                setattr(part, name, values[:0])
        return whole

    def take(self, rows: NDArray[np.intp] | slice) -> "Columns":
        """Rows by number, as copies, or a range of rows as views."""
        return Columns(**{name: column[rows] for name, column in self._present().items()})

    def part(self, start: int, stop: int) -> "Columns":
        """Rows `start` to `stop` as views."""
        return self.take(slice(start, stop))

    def move(self, rows: Mask | slice, start: int) -> None:
        """Copy the selected rows to the rows from `start` on."""
        for column in self._present().values():
            selected = column[rows]
            column[start : start + len(selected)] = selected

    def standardize(self, encoding: Encoding) -> None:
        """Convert raw values of an encoding to the standard layout, in place.

        A value without a counterpart (a negative scale, an opacity outside 0 to 1) becomes NaN, so its row is
        dropped later. A scale of 0 becomes -infinity, and opacities of 0 and 1 become -infinity and infinity,
        which are valid.
        """
        with np.errstate(all="ignore"):
            if encoding.scales == "linear":
                np.log(self.scales, out=self.scales)
            if encoding.opacities != "logit":
                if encoding.opacities == "byte":
                    self.opacities /= 255
                above = (self.opacities > 1) & (self.opacities <= 1 + OPACITY_SLACK)
                self.opacities[above] = 1
                self.opacities[:] = np.log(self.opacities) - np.log1p(-self.opacities)
            if encoding.quats == "xyzw":
                self.quats[:] = self.quats[:, [3, 0, 1, 2]]
            if encoding.colors != "sh":
                full = 255 if encoding.colors == "byte" else 1
                self.sh[:, 0] = (self.sh[:, 0] / full - 0.5) / C0

    def activate(self, *, is_logit: bool) -> None:
        """Convert log-scales to scales and, if `is_logit`, logits to opacities, in place.

        1 / (1 + exp(-x)) is exact at both ends: an exp that overflows gives 0, infinity gives 1.
        """
        np.exp(self.scales, out=self.scales)
        if is_logit:
            np.negative(self.opacities, out=self.opacities)
            np.exp(self.opacities, out=self.opacities)
            self.opacities += 1
            np.reciprocal(self.opacities, out=self.opacities)

    def gaussians(self, *, antialiased: bool = False) -> Gaussians:
        """The finished scene, without a copy."""
        columns = (self.means, self.quats, self.scales, self.opacities, self.sh)
        return Gaussians(*columns, antialiased=antialiased, brushes=self.brushes)


def check_decoded_size(
    path: Path, num_rows: int, num_terms: int, size: int, *, row_size: int = 0, max_growth: int = _MAX_GROWTH
) -> None:
    """Check the memory that a scene will take against the size of its file, before allocating it.

    Args:
        path: the file, for the message.
        num_rows: number of Gaussians that it states.
        num_terms: spherical-harmonic terms of each Gaussian.
        size: bytes of the whole file.
        row_size: additional bytes in memory per Gaussian, for formats that are decompressed first.
        max_growth: most bytes in memory per byte of the file, beyond 64 MiB: 16 bytes of the compressed PLY
            layout become 56, but a file with single bytes for floats could fill the memory.

    Raises:
        SceneError: if the scene would take more.
    """
    decoded = num_rows * (4 * (11 + 3 * num_terms) + row_size)
    if decoded > max_growth * size + _SMALL_SCENE:
        fact = f"{num_rows} Gaussians take {decoded >> 20} MiB in memory and {size >> 20} MiB in the file"
        raise SceneError(path, f"{fact}, too little for numbers of a scene; export it with floats")


def unpack_quats(largest: NDArray[np.signedinteger[Any]], small: F32, out: F32) -> None:
    """Restore unit quaternions w x y z from their three smaller components.

    Args:
        largest: [n] index of the omitted component, which is positive and follows from the unit length.
        small: [n, 3] the other components in order.
        out: [n, 4] target.
    """
    rest = np.sqrt(np.maximum(1 - np.square(small).sum(axis=1), 0))
    for index in range(4):
        before, after = small[:, min(index, 2)], small[:, max(index - 1, 0)]
        out[:, index] = np.where(index < largest, before, np.where(index > largest, after, rest))


_SEARCHED_ROWS = 1 << 14


def find_used_terms(rest: NDArray[Any], num_terms: int, zero: int = 0) -> int:
    """The number of terms (1, 4, 9 or 16) up to the highest band that is not zero in every row.

    Args:
        rest: [N, num_terms - 1 or more, 3] coefficients above degree 0; searched block by block until the
            result is known, for most scenes in one block.
        num_terms: the most terms to count.
        zero: the number that stands for a coefficient of 0.
    """
    for degree in (3, 2, 1):
        start, stop = degree**2, (degree + 1) ** 2
        band = rest[:, start - 1 : stop - 1]
        firsts = range(0, len(rest), _SEARCHED_ROWS)
        if stop <= num_terms and any((band[i : i + _SEARCHED_ROWS] != zero).any() for i in firsts):
            return stop
    return 1


def drop_zero_bands(columns: Columns) -> None:
    """Drop the highest bands if they are zero in every row, for formats without `RowSource.count_used`."""
    used = find_used_terms(columns.sh[:, 1:], columns.sh.shape[1])
    columns.sh = np.ascontiguousarray(columns.sh[:, :used])


_MAX_LOG = np.log(np.finfo(np.float32).max)  # exp of a larger log-scale overflows float32


@dataclass
class Dropped:
    """Counts of dropped rows and of rows with coefficients set to zero, with the first of each."""

    num_broken: int = 0  # rows with NaN, or with infinity where it is invalid
    broken: tuple[int, str, float] | None = None  # the first such value: row, column, value
    num_unrotated: int = 0  # other rows whose quaternion is zero
    unrotated: int | None = None  # the first such row
    num_zeroed: int = 0  # rows with view-dependent coefficients that were not finite
    zeroed: tuple[int, str, float] | None = None  # the first such coefficient: row, column, value

    @property
    def num_rows(self) -> int:
        """The number of dropped rows."""
        return self.num_broken + self.num_unrotated

    def add(self, later: "Dropped") -> None:
        """Add the counts of later rows of the file."""
        self.num_broken += later.num_broken
        self.num_unrotated += later.num_unrotated
        self.broken = self.broken or later.broken
        self.unrotated = later.unrotated if self.unrotated is None else self.unrotated
        self.num_zeroed += later.num_zeroed
        self.zeroed = self.zeroed or later.zeroed

    def report(self, path: Path, num_rows: int) -> None:
        """Warn once about all dropped rows of `num_rows`, and once about all coefficients set to zero.

        Raises SceneError if all rows were dropped.
        """
        if self.zeroed is not None:
            row, name, value = self.zeroed
            what = f"that are not finite count as 0 (first: row {row}, {name} = {value:g})"
            warning = f"{path}: in {self.num_zeroed} of {num_rows} rows view-dependent colors {what}"
            warnings.warn(SceneWarning(warning), stacklevel=3)
        reasons = []
        if self.broken is not None:
            row, name, value = self.broken
            what = f"hold values that cannot be drawn (first: row {row}, {name} = {value:g})"
            reasons.append(f"{self.num_broken} {what}")
        if self.unrotated is not None:
            what = f"have an all-zero rotation, as padding rows do (first: row {self.unrotated})"
            reasons.append(f"{self.num_unrotated} {what}")
        if not reasons:
            return
        because = " and ".join(reasons)
        if self.num_rows == num_rows:
            raise SceneError(path, f"no row of {num_rows} can be used: {because}; export the scene again")
        message = f"{path}: {self.num_rows} of {num_rows} rows were dropped: {because}"
        warnings.warn(SceneWarning(message), stacklevel=3)


Faults = Iterable[tuple[str, Array, Mask]]  # name, values and bad rows of a column


def find_faults(
    block: Columns, first_row: int, num_rest: int, more: Faults = ()
) -> tuple[Mask | None, Dropped]:
    """Find undrawable rows of a block; set view-dependent coefficients that are not finite to 0.

    Args:
        block: rows in the standard layout: log-scales, and logits or opacities.
        first_row: row of the file at which the block begins, for messages.
        num_rest: f_rest coefficients per channel in the file, for column names in messages.
        more: faults of further columns of the format.

    Returns:
        A mask of the drawable rows, or None if all are; and the dropped rows.
    """
    more = list(more)
    if _is_sound(block) and not any(is_bad.any() for _, _, is_bad in more):
        return None, Dropped()
    broken = np.zeros(len(block.means), dtype=bool)
    first: tuple[int, str, float] | None = None
    for name, column, is_bad in chain(_faults_of(block, num_rest), more):
        if is_bad.any() and (first is None or np.argmax(is_bad) < first[0]):
            row = int(np.argmax(is_bad))
            first = row, name, float(column[row])
        broken |= is_bad
    unrotated = ~block.quats.any(axis=1) & ~broken
    is_bad = broken | unrotated
    zeroed = _zero_rest(block, ~is_bad, first_row, num_rest)
    if not is_bad.any():
        return None, zeroed
    dropped = Dropped(
        int(np.count_nonzero(broken)),
        None if first is None else (first[0] + first_row, *first[1:]),
        int(np.count_nonzero(unrotated)),
        first_row + int(np.argmax(unrotated)) if unrotated.any() else None,
    )
    dropped.add(zeroed)
    return ~is_bad, dropped


def _is_sound(block: Columns) -> bool:
    """Whether every row is certainly drawable; if False, each value must be checked.

    The largest and smallest value of a column reveal NaN and infinity without a mask of its size.
    """
    ends = [end for column in (block.means, block.quats, block.sh) for end in (column.max(), column.min())]
    is_sound = np.isfinite(ends).all() and block.scales.max() < _MAX_LOG
    is_sound = is_sound and not np.isnan(block.opacities.max())
    return bool(is_sound and (block.quats[:, 0].all() or block.quats.any(axis=1).all()))


def _faults_of(block: Columns, num_rest: int) -> Iterator[tuple[str, F32, Mask]]:
    """Yield the name in the file, the values and the mask of broken rows of each column.

    A log-scale of -infinity is a scale of 0, an infinite logit is an opacity of 0 or 1: both are valid.
    """
    for index, name in enumerate("xyz"):
        yield name, block.means[:, index], ~np.isfinite(block.means[:, index])
    for index in range(4):
        yield f"rot_{index}", block.quats[:, index], ~np.isfinite(block.quats[:, index])
    for index in range(3):
        yield f"scale_{index}", block.scales[:, index], ~(block.scales[:, index] < _MAX_LOG)
    yield "opacity", block.opacities, np.isnan(block.opacities)
    for channel in range(3):
        yield f"f_dc_{channel}", block.sh[:, 0, channel], ~np.isfinite(block.sh[:, 0, channel])


def _zero_rest(block: Columns, kept: Mask, first_row: int, num_rest: int) -> Dropped:
    """Set view-dependent coefficients of `kept` rows that are not finite to 0, in place."""
    is_bad = ~np.isfinite(block.sh[:, 1:]) & kept[:, None, None]
    if not is_bad.any():
        return Dropped()
    row, term, channel = (int(index) for index in np.argwhere(is_bad)[0])
    first = first_row + row, f"f_rest_{channel * num_rest + term}", float(block.sh[row, 1 + term, channel])
    block.sh[:, 1:][is_bad] = 0
    return Dropped(num_zeroed=int(np.count_nonzero(is_bad.any(axis=(1, 2)))), zeroed=first)
