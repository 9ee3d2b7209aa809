"""Work on many rows in blocks that stay in the cache, and in threads."""

from collections.abc import Callable

from brushgs.core.threads import in_turn

ROWS = 1 << 15  # in a block: a million numbers at a time would go through memory in every step
MOST_THREADS = 8  # NumPy holds Python's lock between steps


def blocks_of(num: int) -> list[slice]:
    """The rows 0 to num - 1 in blocks."""
    return [slice(first, min(first + ROWS, num)) for first in range(0, num, ROWS)]


def for_blocks(work: Callable[[slice], None], num: int) -> None:
    """Call `work` for each block of rows; its output must depend only on its rows."""
    for _ in in_turn(work, blocks_of(num), at_once=MOST_THREADS):
        pass
