"""Rows of a scene file that cannot be drawn: found, dropped, and reported in one sentence.

A view-dependent coefficient of colour that is not finite costs no row: it counts as 0, and is reported.
"""

import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError, SceneWarning
from brushgs.formats.scenes.columns import Columns
from brushgs.values.arrays import F32, Mask

_MAX_LOG = np.log(np.finfo(np.float32).max)  # exp of a larger log-scale overflows float32


@dataclass
class Dropped:
    """Rows of a file that were dropped, and numbers that count as zero."""

    num_broken: int = 0  # rows with NaN, or infinity where it has no meaning
    broken: tuple[int, str, float] | None = None  # the first of them: row, column, value
    num_unrotated: int = 0  # other rows whose quaternion is zero
    unrotated: int | None = None  # the first of them
    num_zeroed: int = 0  # rows with view-dependent coefficients that were not finite
    zeroed: tuple[int, str, float] | None = None  # the first of these: row, column, value

    @property
    def num_rows(self) -> int:
        """All dropped rows."""
        return self.num_broken + self.num_unrotated

    def add(self, later: "Dropped") -> None:
        """Add the rows dropped further down the file."""
        self.num_broken += later.num_broken
        self.num_unrotated += later.num_unrotated
        self.broken = self.broken or later.broken
        self.unrotated = later.unrotated if self.unrotated is None else self.unrotated
        self.num_zeroed += later.num_zeroed
        self.zeroed = self.zeroed or later.zeroed

    def report(self, path: Path, num_rows: int) -> None:
        """Warn once of all dropped rows of so many, and once of all that counts as zero.

        Raises SceneError if all rows were dropped.
        """
        if self.zeroed is not None:
            row, name, value = self.zeroed
            what = f"that are not finite count as 0 (first: row {row}, {name} = {value:g})"
            warning = f"{path}: in {self.num_zeroed} of {num_rows} rows view-dependent colours {what}"
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


Faults = Iterable[tuple[str, NDArray[np.floating[Any]], Mask]]  # name of a column, its values, which are bad


def drop_faults(block: Columns, first_row: int, num_rest: int) -> Dropped:
    """Move the rows that can be drawn to the front of a block, in order. Takes the same as `find_faults`."""
    keep, dropped = find_faults(block, first_row, num_rest)
    if keep is not None:
        block.move(keep, 0)
    return dropped


def find_faults(
    block: Columns, first_row: int, num_rest: int, more: Faults = ()
) -> tuple[Mask | None, Dropped]:
    """The rows of a block that cannot be drawn; view-dependent coefficients that are not finite become zero.

    Args:
        block: some rows in the standard layout: log-scales, and logits or opacities.
        first_row: row of the file that the block begins with, for messages.
        num_rest: f_rest coefficients per channel in the file, for the names of columns in messages.
        more: of columns that a format has beside the standard ones.

    Returns:
        Which rows can be drawn, None where all can; and the others.
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
    """Whether every row can be drawn; False may only mean that each value must be checked.

    The largest and smallest value of a column reveal NaN and infinity without a mask of its size.
    """
    ends = [end for column in (block.means, block.quats, block.sh) for end in (column.max(), column.min())]
    is_sound = np.isfinite(ends).all() and block.scales.max() < _MAX_LOG
    is_sound = is_sound and not np.isnan(block.opacities.max())
    return bool(is_sound and (block.quats[:, 0].all() or block.quats.any(axis=1).all()))


def _faults_of(block: Columns, num_rest: int) -> Iterator[tuple[str, F32, Mask]]:
    """Name, values and mask of broken rows of each column as the file names it.

    A log-scale of -infinity is a scale of 0, a logit of infinity an opacity of 1 or 0: both are valid.
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
    """Make view-dependent coefficients of rows that are `kept` zero where they are not finite, in place."""
    is_bad = ~np.isfinite(block.sh[:, 1:]) & kept[:, None, None]
    if not is_bad.any():
        return Dropped()
    row, term, channel = (int(index) for index in np.argwhere(is_bad)[0])
    first = first_row + row, f"f_rest_{channel * num_rest + term}", float(block.sh[row, 1 + term, channel])
    block.sh[:, 1:][is_bad] = 0
    return Dropped(num_zeroed=int(np.count_nonzero(is_bad.any(axis=(1, 2)))), zeroed=first)
