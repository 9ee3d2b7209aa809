"""Cases of a test that has several parameters: every pair of values, not every product."""

from collections.abc import Iterable
from itertools import combinations
from typing import Any


def pairs_of(*axes: Iterable[Any]) -> list[tuple[Any, ...]]:
    """Few cases in which each value of each axis meets each value of every other axis.

    Chosen one after the other, each the one of the product that has most pairs that none before it has.
    """
    values = [tuple(axis) for axis in axes]
    cases: list[tuple[int, ...]] = [()]
    for axis in values:
        cases = [(*case, index) for case in cases for index in range(len(axis))]
    left = {pair for case in cases for pair in _pairs(case)}
    chosen = []
    while left:
        best = max(cases, key=lambda case: len(left.intersection(_pairs(case))))
        left.difference_update(_pairs(best))
        chosen.append(tuple(values[axis][index] for axis, index in enumerate(best)))
    return chosen


def _pairs(case: tuple[int, ...]) -> list[tuple[tuple[int, int], ...]]:
    return list(combinations(enumerate(case), 2))
