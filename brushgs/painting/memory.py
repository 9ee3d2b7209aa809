"""What the steps of `prepare` returned, so that a painting that is changed a little is not made all anew.

A step is made again where an input differs. Arrays and what holds them are compared by identity: a step that
is not made again returns the very same object, so what follows it is found unchanged too.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

T = TypeVar("T")


class Memory:
    """The last result of each step, by its name.

    Attributes:
        made: how often each step was made.
    """

    def __init__(self) -> None:
        self.made: Counter[str] = Counter()
        self._kept: dict[str, tuple[tuple[object, ...], Any]] = {}

    def of(self, step: str, inputs: Sequence[object], make: Callable[[], T]) -> T:
        """The result of a step: the last one, if its inputs are the same, else a new one.

        Args:
            step: its name.
            inputs: everything that its result depends on: options, compared by value; arrays and what holds
                them, compared by identity; and tuples of both.
            make: makes the result. It is not remembered if it raises.
        """
        known = self._kept.get(step)
        if known is not None and _is_same(known[0], tuple(inputs)):
            result: T = known[1]
            return result
        self._kept.pop(step, None)  # before another takes its room
        result = make()
        self.made[step] += 1
        self._kept[step] = tuple(inputs), result
        return result


class NoMemory(Memory):
    """Makes every step, and keeps nothing."""

    def of(self, step: str, inputs: Sequence[object], make: Callable[[], T]) -> T:
        """A new result."""
        return make()


def _is_same(known: object, other: object) -> bool:
    if known is other:
        return True
    if isinstance(known, tuple) and isinstance(other, tuple):
        return len(known) == len(other) and all(map(_is_same, known, other))
    return (known == other) is True  # arrays, and what holds them, are compared by identity
