"""A law over a table: one case of pytest, in place of one for each row."""

import inspect
from collections.abc import Callable, Iterable
from functools import wraps
from itertools import product
from typing import Any

import pytest


def for_each(names: str | tuple[str, ...], rows: Iterable[Any], ids: object = None) -> Callable:
    """As `pytest.mark.parametrize`, for tests whose rows share no state: all rows are one case.

    A row that breaks the law ends the case, and a note at the error names it. Of several tables every
    combination is a row. Rows that are skipped do not end the case; it is skipped where all of them are.
    What a row patches is undone before the next.
    """
    keys = tuple(name.strip() for name in names.split(",")) if isinstance(names, str) else tuple(names)
    table = [dict(zip(keys, _values(row, len(keys)), strict=True)) for row in rows]

    def decorated(test: Callable) -> Callable:
        inner, tables = getattr(test, "of_row", test), [table, *getattr(test, "tables", [])]

        @wraps(inner)
        def law(**fixtures: Any) -> None:
            reasons = []
            for parts in product(*tables):
                row = {name: value for part in parts for name, value in part.items()}
                try:
                    with pytest.MonkeyPatch.context() as own:
                        patching = {"monkeypatch": own} if "monkeypatch" in fixtures else {}
                        inner(**row, **(fixtures | patching))
                except pytest.skip.Exception as skip:
                    reasons.append(str(skip))
                except BaseException as error:
                    error.add_note(f"in the row {row}")
                    raise
            if reasons and len(reasons) == len(list(product(*tables))):
                pytest.skip(reasons[0])

        taken = {name for part in tables for name in part[0]}
        kept = [p for name, p in inspect.signature(inner).parameters.items() if name not in taken]
        law.__signature__ = inspect.Signature(kept)
        law.of_row, law.tables = inner, tables
        return law

    return decorated


def _values(row: Any, count: int) -> tuple[Any, ...]:
    if hasattr(row, "marks") and hasattr(row, "values"):  # pytest.param
        return tuple(row.values)
    return tuple(row) if count > 1 else (row,)
