"""Runs are timed in turns, so that a machine that slows down slows all of them."""

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

SLOW, SLOW_REPEATS = 2.0, 3  # seconds from which on a run is repeated no more often than that
QUICK, QUICK_PASSES = 0.1, 3  # seconds under which it runs so many times in each round


@dataclass(frozen=True)
class Spread:
    """Seconds of repeated runs of one thing: median and quartiles."""

    q1: float
    median: float
    q3: float
    runs: int

    @classmethod
    def of(cls, seconds: list[float]) -> "Spread":
        """Of at least one run."""
        q1, median, q3 = np.percentile(seconds, (25, 50, 75))
        return cls(float(q1), float(median), float(q3), len(seconds))


@dataclass(frozen=True, eq=False)
class Run:
    """Something to time; one that several points share is timed once in each round.

    Attributes:
        work: what is timed.
        check: told each result, untimed; raises if it is not what was verified.
    """

    work: Callable[[], Any]
    check: Callable[[Any], None]


def time_in_turns(
    runs: Iterable[Run], repeats: int, advance: Callable[[], None] = lambda: None
) -> dict[Run, list[float]]:
    """Time each run `repeats` times, one after the other in rounds. All ran before, when they were verified.

    Slow ones (from 2 seconds on) run 3 times at most, quick ones (under 0.1) in 3 passes of each round.

    Args:
        runs: each is taken once.
        repeats: rounds, >= 1.
        advance: called once per run and round.

    Returns:
        Seconds of each run, in the order of the rounds.
    """
    seconds: dict[Run, list[float]] = {run: [] for run in runs}
    for turn in range(repeats):
        for run, before in seconds.items():
            if not (turn >= SLOW_REPEATS and before[0] > SLOW):
                before.append(_timed(run))
            advance()
        for _ in range(QUICK_PASSES - 1):
            for run, before in seconds.items():
                if before[0] < QUICK:
                    before.append(_timed(run))
    return seconds


def _timed(run: Run) -> float:
    start = time.perf_counter()
    result = run.work()
    seconds = time.perf_counter() - start
    run.check(result)
    return seconds
