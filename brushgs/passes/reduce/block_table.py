"""The sums of all cells of a scene, with a maximum number of cells."""

import numpy as np

from brushgs.passes.reduce.block_cells import MOST_DEPTH, Keys, coarser, deepest
from brushgs.values.arrays import F64, Mask, Rows


def sums_by_cell(keys: Keys, values: F64) -> tuple[Keys, F64]:
    """The distinct cells, ascending [n], and the sums of the values [F, N] in each, [F, n]."""
    used, cells = np.unique(keys, return_inverse=True)
    if len(used) == len(keys):
        sums = np.empty_like(values)
        sums[:, cells] = values
        return used, sums
    return used, np.stack([np.bincount(cells, row, len(used)) for row in values])


class CellTable:
    """Sums by cell.

    The final cells, and the sums except for rounding, do not depend on the order and division of the input: a
    depth is dropped as soon as it has too many cells, and later blocks only add more.

    Attributes:
        most: maximum number of cells.
        depth: of the deepest cells.
    """

    def __init__(self, most: int) -> None:
        self.most = most
        self.depth = MOST_DEPTH
        self._keys: Keys = np.empty(0, np.int64)  # ascending
        self._places: Rows = np.empty(0, np.intp)  # position of each cell's sums
        self._sums: list[F64] = []  # F of [most], of which the first len(self) are in use

    def __len__(self) -> int:
        return len(self._keys)

    def add(self, keys: Keys, sums: F64) -> None:
        """Add sums [F, n] to distinct cells; F may differ from earlier ones."""
        if self.depth < MOST_DEPTH:
            keys, sums = sums_by_cell(coarser(keys, self.depth), sums)
        at, is_new = self._find(keys)
        if len(self) + np.count_nonzero(is_new) > self.most:
            self._give_up_depth(keys[is_new])
            keys, sums = sums_by_cell(coarser(keys, self.depth), sums)
            at, is_new = self._find(keys)
        while len(self._sums) < len(sums):
            self._sums.append(np.zeros(self.most))  # takes memory only where it is written to
        known, first, last = self._places[at[~is_new]], len(self), len(self) + np.count_nonzero(is_new)
        for number, row in enumerate(self._sums):
            row[first:last] = sums[number, is_new] if number < len(sums) else 0
            if number < len(sums):
                row[known] += sums[number, ~is_new]
        self._keys = np.insert(self._keys, at[is_new], keys[is_new])
        self._places = np.insert(self._places, at[is_new], np.arange(first, last))

    def take(self) -> tuple[Keys, F64]:
        """The cells, ascending [n], and their sums [F, n]; the table is empty afterwards."""
        keys, sums = self._keys, np.empty((len(self._sums), len(self)))
        for number in reversed(range(len(self._sums))):
            sums[number] = self._sums.pop()[self._places]
        self._keys, self._places = keys[:0], self._places[:0]
        return keys, sums

    def _find(self, keys: Keys) -> tuple[Rows, Mask]:
        """The position of each key, and whether it is new."""
        at = np.searchsorted(self._keys, keys)
        is_new = np.ones(len(keys), bool)
        inside = at < len(self._keys)
        is_new[inside] = self._keys[at[inside]] != keys[inside]
        return at, is_new

    def _give_up_depth(self, more: Keys) -> None:
        """Move the deepest cells into their parents, until there is room for more."""
        self.depth = deepest(np.concatenate([self._keys, more]), self.most, self.depth)
        used, cells = np.unique(coarser(self._keys, self.depth), return_inverse=True)
        columns = np.empty(len(cells), np.intp)
        columns[self._places] = cells
        for row in self._sums:
            row[: len(used)] = np.bincount(columns, row[: len(cells)], len(used))
        self._keys, self._places = used, np.arange(len(used))
