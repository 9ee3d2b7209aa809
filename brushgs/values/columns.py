"""Convert and check the columns of a frozen dataclass of arrays.

Columns are arrays or lists of numbers. They become contiguous, read-only arrays, copied only if needed. All
float columns share one dtype; integer columns have their own.
"""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import Mask

RowChoice = NDArray[np.integer[Any]] | Mask | Sequence[int] | Sequence[bool] | slice
Integers = Mapping[str, type[np.integer[Any]]]  # integer columns -> their dtypes
NOT_COLUMNS = (bool, float | None)  # types of fields that hold one value for all rows


def freeze_columns(where: str, value: Any, integers: Integers) -> None:
    """Make every column of a frozen dataclass a contiguous, read-only array.

    All but `integers` must share one float dtype. Lists and integer arrays are converted to the dtype of
    their column.

    Args:
        where: name of the class; the error message starts with it.
        value: the dataclass. Fields of a type in `NOT_COLUMNS`, and None in fields that default to None, are
            skipped.
        integers: integer columns.

    Raises:
        TypeError: if a column is not an array or list of numbers, or dtypes differ.
        ValueError: if an integer does not fit the dtype of its column.
    """
    columns = {f.name: getattr(value, f.name) for f in fields(value) if f.type not in NOT_COLUMNS}
    given = (c.dtype for name, c in columns.items() if isinstance(c, np.ndarray) and name not in integers)
    dtype_of_rest = next((dtype for dtype in given if dtype.kind == "f"), np.dtype(np.float32))
    dtypes = {}
    for f in fields(value):
        column = columns.get(f.name)
        if (column is None and f.default is None) or f.type in NOT_COLUMNS:
            continue
        column = _array_of(where, f.name, column, np.dtype(integers.get(f.name, dtype_of_rest)))
        if f.name not in integers:
            dtypes[f.name] = column.dtype
        column = np.ascontiguousarray(column).view()
        column.flags.writeable = False
        object.__setattr__(value, f.name, column)
    name, dtype = next(iter(dtypes.items()))
    if dtype not in (np.float32, np.float64):
        raise TypeError(f"{where}: {name} must be float32 or float64, got {dtype}")
    for other, other_dtype in dtypes.items():
        if other_dtype != dtype:
            raise TypeError(f"{where}: {other} must be {dtype} like {name}, got {other_dtype}")


def _array_of(where: str, name: str, values: Any, dtype: np.dtype[Any]) -> NDArray[Any]:
    """A column as an array: float arrays unchanged, lists and integers converted to `dtype`."""
    is_whole = dtype.kind in "iu"
    if isinstance(values, list | tuple):
        try:
            values = np.asarray(values)
        except (TypeError, ValueError):  # rows of several lengths
            values = np.asarray(None)
        if values.dtype.kind not in ("iu" if is_whole else "iuf") and values.size:
            kind = "whole numbers" if is_whole else "numbers, in rows of one length"
            raise TypeError(f"{where}: {name} must be an array or a list of {kind}")
        return _converted(where, name, values, dtype)
    if not isinstance(values, np.ndarray):
        raise TypeError(f"{where}: {name} must be a NumPy array, got {type(values).__name__}")
    if values.dtype == dtype or (values.dtype.kind == "f" and not is_whole):
        return values
    # uint8 is refused: most likely 0 to 255 instead of 0 to 1.
    if values.dtype.kind not in "iu" or (values.dtype == np.uint8 and not is_whole):
        rule = dtype.name if is_whole else "float32 or float64"
        raise TypeError(f"{where}: {name} must be {rule}, got {values.dtype}")
    return _converted(where, name, values, dtype)


def _converted(where: str, name: str, values: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Values in the dtype of their column; integers must be represented exactly."""
    if dtype.kind in "iu" and values.size:
        least, most = np.iinfo(dtype).min, np.iinfo(dtype).max
        if values.min() < least or values.max() > most:
            raise ValueError(
                f"{where}: {name} must lie in {least} to {most}, got {values.min()} to {values.max()}"
            )
    column = values.astype(dtype)
    if values.dtype.kind in "iu" and not np.array_equal(column, values):
        raise ValueError(f"{where}: {name} has whole numbers that {dtype} cannot hold; give them as float64")
    return column


def take_rows(where: str, columns: Mapping[str, Any], rows: RowChoice) -> dict[str, Any]:
    """Rows of every column, in the order of the choice; columns that are None stay None.

    Raises:
        TypeError: if the choice is not a slice, or a list or an array of numbers or of bools; the message
            starts with `where`.
        IndexError: if a row is out of range, or a mask has another length.
    """
    chosen = rows if isinstance(rows, slice) else np.asarray(rows)
    if isinstance(chosen, np.ndarray):
        if chosen.ndim != 1 or (chosen.dtype.kind not in "iub" and chosen.size):
            given = f"{rows!r}" if chosen.ndim == 0 else f"{chosen.dtype} of shape {list(chosen.shape)}"
            raise TypeError(
                f"{where}: rows must be a slice, or a list or an array of numbers or of bools, got {given}"
            )
        if chosen.dtype.kind == "b":
            num_rows = len(next(column for column in columns.values() if column is not None))
            if len(chosen) != num_rows:
                raise IndexError(f"{where}: a mask must have {num_rows} rows, got {len(chosen)}")
            chosen = np.flatnonzero(chosen)
        chosen = chosen.astype(np.intp, copy=False)

    def taken(column: Any) -> Any:
        # 5 to 60 times as fast as column[chosen] for columns of two or three numbers
        return column[chosen] if isinstance(chosen, slice) else column.take(chosen, axis=0)

    return {name: None if column is None else taken(column) for name, column in columns.items()}


def check_finite(where: str, value: Any) -> None:
    """Refuse NaN and infinity, naming column and row. A finite sum proves a column finite without a mask."""
    columns = {f.name: getattr(value, f.name) for f in fields(value) if f.type not in NOT_COLUMNS}
    with np.errstate(over="ignore", invalid="ignore"):
        suspects = [
            (name, column)
            for name, column in columns.items()
            if column is not None and not isfinite(np.add.reduce(column, axis=None))
        ]
    for name, column in suspects:
        check_rows(where, name, "be finite", ~np.isfinite(column).reshape(len(column), -1).all(axis=1))


def check_rows(where: str, name: str, rule: str, is_bad: Mask) -> None:
    """Raise ValueError with the number of rows that break the rule and the first of them."""
    if is_bad.any():
        num_bad, first = np.count_nonzero(is_bad), np.argmax(is_bad)
        raise ValueError(f"{where}: {name} must {rule}, got {num_bad} other rows, first at {first}")
