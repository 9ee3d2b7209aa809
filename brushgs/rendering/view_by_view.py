"""Process several small views of a scene in parallel.

A picture of 100,000 pixels takes a few milliseconds in the core, and as long in Python and NumPy: two views
in parallel keep two cores busy (a painting of 250 strokes takes 0.8 of the time).
"""

from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

from brushgs.core.threads import MOST_AT_ONCE, in_turn

# Gaussians. Boxes and their sums take about 150 bytes per row and view; larger scenes use threads of the
# core.
MOST_ROWS = 300_000
View = TypeVar("View")
Result = TypeVar("Result")


def view_by_view(
    work: Callable[[View], Result], views: Iterable[View], num_rows: int, num_threads: int | None = None
) -> Iterator[Result]:
    """Results of `work` in the order of the views, so that sums do not depend on the number of threads.

    Args:
        work: called in several threads.
        views: its arguments.
        num_rows: Gaussians of the scene; above `MOST_ROWS`, views are processed one at a time.
        num_threads: None takes the processors available to this process.
    """
    return in_turn(work, views, num_threads, at_once=MOST_AT_ONCE if num_rows <= MOST_ROWS else 1)
