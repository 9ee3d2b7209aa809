"""The columns of a scene while a file is read into them, and what its numbers mean.

Some exporters store scales and opacities directly in place of their logarithms and logits, rotations as
x, y, z, w, or plain RGB in place of spherical harmonics. The file does not state it: the caller must, or
`brushgs doctor`, which detects it from the numbers. Bands of spherical harmonics that are zero in every row
are not loaded, which changes no picture.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError
from brushgs.values.arrays import F32
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0

Scales = Literal["log", "linear"]
Opacities = Literal["logit", "linear", "byte"]
Quats = Literal["wxyz", "xyzw"]
Colors = Literal["sh", "rgb", "byte"]
_WORDS = {"scales": Scales, "opacities": Opacities, "quats": Quats, "colors": Colors}


@dataclass(frozen=True)
class Encoding:
    """What the columns of a file hold. The defaults are the standard layout, which trainers write.

    Attributes:
        scales: "log" for natural logarithms, "linear" for standard deviations in world units.
        opacities: "logit", "linear" for 0 to 1, "byte" for 0 to 255.
        quats: the order of rot_0 to rot_3.
        colors: what f_dc holds: "sh" for coefficients, "rgb" for display-encoded 0 to 1, "byte" for 0 to 255.

    Raises:
        ValueError: if a word is none of these.
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


# An opacity of 1 that passed through other arithmetic may lie this far above 1; more is no opacity.
OPACITY_SLACK = 1e-3
# A scene in memory has 4 bytes a number; a large file with less than one per number is malicious or damaged.
_MAX_GROWTH, _SMALL_SCENE = 4, 64 << 20


@dataclass
class Columns:
    """Arrays of n rows to be filled; scales and opacities hold logs and logits until `activate`."""

    means: F32  # [n, 3]
    quats: F32  # [n, 4]
    scales: F32  # [n, 3]
    opacities: F32  # [n]
    sh: F32  # [n, k, 3]
    brushes: NDArray[np.uint8] | None = None  # [n]

    @classmethod
    def empty(cls, num_rows: int, num_terms: int, *, has_brushes: bool = False) -> "Columns":
        """Uninitialised columns of so many rows and spherical-harmonic terms."""
        shapes = (3,), (4,), (3,), (), (num_terms, 3)
        columns = cls(*(np.empty((num_rows, *shape), np.float32) for shape in shapes))
        columns.brushes = np.empty(num_rows, np.uint8) if has_brushes else None
        return columns

    def _present(self) -> dict[str, NDArray[Any]]:
        """The columns that there are, by name."""
        columns = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: column for name, column in columns.items() if column is not None}

    @classmethod
    def joined(cls, parts: "list[Columns]") -> "Columns":
        """The rows of all parts in order, with as many spherical-harmonic terms as the most of them have.

        The parts are emptied column by column, so that little more than the scene is in memory at once.
        Brushes are dropped: they are rows of different sets.
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
                if values.ndim == 3:  # a scene of a lower degree has zeros above it
                    rows[:, values.shape[1] :] = 0
                    rows = rows[:, : values.shape[1]]
                rows[:] = values
                start += len(values)
                setattr(part, name, values[:0])
        return whole

    def part(self, start: int, stop: int) -> "Columns":
        """Rows `start` to `stop` as views."""
        return Columns(**{name: column[start:stop] for name, column in self._present().items()})

    def move(self, rows: NDArray[np.bool_] | slice, start: int) -> None:
        """Copy the selected rows to `start` and after."""
        for column in self._present().values():
            selected = column[rows]
            column[start : start + len(selected)] = selected

    def standardize(self, encoding: Encoding) -> None:
        """Turn raw values of an encoding into those of the standard layout, in place.

        A value that has no counterpart (a negative scale, an opacity outside 0 to 1) becomes NaN, whose row
        is then dropped like any other. A scale of 0 becomes -infinity and opacities of 0 and 1 become
        infinite, which is right.
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
        """Turn log-scales into scales and logits into opacities, in place.

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
    """Compare the memory that a scene will take with the size of its file, before it is allocated.

    Args:
        path: the file, for the message.
        num_rows: Gaussians that it states.
        num_terms: spherical-harmonic terms of each.
        size: bytes of the whole file.
        row_size: bytes of a Gaussian that are in memory beside it, of formats that are decompressed first.
        max_growth: how many times the file the scene may take beyond 64 MiB: 16 bytes of the compressed PLY
            layout become 56, but a file of single bytes in place of floats would fill the memory.

    Raises:
        SceneError: if it takes more.
    """
    decoded = num_rows * (4 * (11 + 3 * num_terms) + row_size)
    if decoded > max_growth * size + _SMALL_SCENE:
        fact = f"{num_rows} Gaussians take {decoded >> 20} MiB in memory and {size >> 20} MiB in the file"
        raise SceneError(path, f"{fact}, too little for numbers of a scene; export it with floats")


def unpack_quats(largest: NDArray[np.signedinteger[Any]], small: F32, out: F32) -> None:
    """Write unit quaternions w x y z, [n, 4], of which the largest component is not stored.

    Args:
        largest: [n] which one that is; it is positive and follows from the unit length.
        small: [n, 3] the others in order.
        out: where they go.
    """
    rest = np.sqrt(np.maximum(1 - np.square(small).sum(axis=1), 0))
    for index in range(4):
        before, after = small[:, min(index, 2)], small[:, max(index - 1, 0)]
        out[:, index] = np.where(index < largest, before, np.where(index > largest, after, rest))


_SEARCHED_ROWS = 1 << 14


def find_used_terms(num_terms: int, num_rows: int, is_used: Callable[[int, int, slice], bool]) -> int:
    """The number of terms up to the highest band that is not zero in every row, of 1, 4, 9 or 16 terms.

    `is_used` says whether any of the terms `start` to `stop` is not zero in some rows; it is asked for blocks
    of rows until the answer is known, for most scenes once.
    """
    for degree in (3, 2, 1):
        start, stop = degree**2, (degree + 1) ** 2
        if stop <= num_terms and any(
            is_used(start, stop, slice(first, first + _SEARCHED_ROWS))
            for first in range(0, num_rows, _SEARCHED_ROWS)
        ):
            return stop
    return 1


def drop_zero_bands(columns: Columns) -> None:
    """Drop the highest bands that are zero in every row, for formats where only decoding shows it."""
    used = find_used_terms(
        columns.sh.shape[1],
        len(columns.sh),
        lambda start, stop, rows: bool(columns.sh[rows, start:stop].any()),
    )
    columns.sh = np.ascontiguousarray(columns.sh[:, :used])
