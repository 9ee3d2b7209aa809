"""Make the next result while the previous one is used."""

from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Generator

    from brushgs.pipeline.report import Stopwatch

R = TypeVar("R")
_END = object()


def one_ahead(results: "Generator[R, None, None]", making: "Stopwatch") -> "Generator[R, None, None]":
    """Make results in a thread of their own, at most one before it is requested.

    Args:
        results: makes them; closed at the end. Its work outside Python's lock runs beside the caller.
        making: gets the time to make them, however long the caller waited.

    Returns:
        A generator of the same results.

    Raises:
        Exception: whatever `results` raises, in the turn of that result.
    """

    def make() -> object:
        with making.running():
            return next(results, _END)

    with closing(results), ThreadPoolExecutor(1, "brushgs-ahead") as thread:
        following = thread.submit(make)
        while (result := following.result()) is not _END:
            following = thread.submit(make)
            yield result  # type: ignore[misc]
