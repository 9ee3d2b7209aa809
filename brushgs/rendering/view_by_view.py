"""The same work for each of some small views of a scene, several views at once.

A picture of 100,000 pixels takes the core a few milliseconds, and Python and NumPy around it as long: two
views side by side keep both of two cores busy (a painting of 250 strokes takes 0.8 of the time).
"""

from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

from brushgs.core.threads import MOST_AT_ONCE, in_turn

# Gaussians. Boxes and their sums take some 150 bytes a row and view; for larger scenes the core has threads.
MOST_ROWS = 300_000
View = TypeVar("View")
Result = TypeVar("Result")


def view_by_view(
    work: Callable[[View], Result], views: Iterable[View], num_rows: int, num_threads: int | None = None
) -> Iterator[Result]:
    """`work` of each view, in the order of the views: sums over them are the same for any number of threads.

    Args:
        work: called in several threads.
        views: what it is called with.
        num_rows: Gaussians of the scene; of more than `MOST_ROWS` one view is looked at a time.
        num_threads: None takes the processors available to this process.
    """
    return in_turn(work, views, num_threads, at_once=MOST_AT_ONCE if num_rows <= MOST_ROWS else 1)
