"""Alternating timing of runs, so that a machine that slows down affects all of them."""

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

SLOW, SLOW_ROUNDS = 2.0, 3  # a run of more seconds takes part in this many rounds at most
QUICK, QUICK_PASSES = 0.1, 3  # a run of fewer seconds is timed this many times in each round


@dataclass(frozen=True)
class TimeQuartiles:
    """Seconds of repeated runs of one thing: median and quartiles."""

    q1: float
    median: float
    q3: float
    runs: int

    @classmethod
    def of(cls, seconds: list[float]) -> "TimeQuartiles":
        """The quartiles of one or more runs."""
        q1, median, q3 = np.percentile(seconds, (25, 50, 75))
        return cls(float(q1), float(median), float(q3), len(seconds))

    def is_same_as(self, other: "TimeQuartiles") -> bool:
        """Whether the quartiles of one lie between those of the other, so that their order is unknown."""
        first, second = sorted((self, other), key=lambda one: one.q3 - one.q1)
        return second.q1 <= first.q1 and first.q3 <= second.q3


@dataclass(frozen=True, eq=False)
class TimedRun:
    """Work to time; work that several points share is timed once per round.

    Attributes:
        work: the work.
        check: gets each result, untimed; raises if it differs from the verified one.
    """

    work: Callable[[], Any]
    check: Callable[[Any], None]


def time_alternately(
    runs: Iterable[TimedRun], repeats: int, advance: Callable[[], None] = lambda: None
) -> dict[TimedRun, list[float]]:
    """Time all runs in rounds, one after the other. Their verification was the warm-up.

    Slow runs (above 2 seconds) take part in 3 rounds at most, quick ones (below 0.1) run 3 times per round.

    Args:
        runs: duplicates count once.
        repeats: number of rounds, >= 1.
        advance: called once per run and round.

    Returns:
        Seconds of each run, in the order of the rounds.
    """
    seconds: dict[TimedRun, list[float]] = {run: [] for run in runs}
    for turn in range(repeats):
        for run, before in seconds.items():
            if not (turn >= SLOW_ROUNDS and before[0] > SLOW):
                before.append(_timed(run))
            advance()
        for _ in range(QUICK_PASSES - 1):
            for run, before in seconds.items():
                if before[0] < QUICK:
                    before.append(_timed(run))
    return seconds


def _timed(run: TimedRun) -> float:
    start = time.perf_counter()
    result = run.work()
    seconds = time.perf_counter() - start
    run.check(result)
    return seconds
