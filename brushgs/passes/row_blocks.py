"""Work on many rows in blocks that stay in the cache, and in threads."""

from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

from brushgs.threads import num_threads_or_default

ROWS = 1 << 15  # in a block: a million numbers at a time would go through memory in every step
MOST_THREADS = 8  # NumPy holds Python's lock between steps
Item = TypeVar("Item")
Done = TypeVar("Done")


def in_order(work: Callable[[Item], Done], items: Iterable[Item], num_threads: int) -> Iterator[Done]:
    """`map`, in threads if there are several: NumPy and the core work without Python's lock."""
    if num_threads < 2:
        yield from map(work, items)
        return
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(num_threads) as pool:
        yield from pool.map(work, items)


def blocks_of(num: int) -> list[slice]:
    """The rows 0 to num - 1 in blocks."""
    return [slice(first, min(first + ROWS, num)) for first in range(0, num, ROWS)]


def for_blocks(work: Callable[[slice], None], num: int) -> None:
    """Call `work` for each block of so many rows; what it writes must depend on its rows alone."""
    blocks = blocks_of(num)
    for _ in in_order(work, blocks, min(num_threads_or_default(None), MOST_THREADS, len(blocks))):
        pass
