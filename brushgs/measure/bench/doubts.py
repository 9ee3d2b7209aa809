"""Doubts about the figures of a bench: other work on the machine, and a curve that rises again."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from brushgs.measure.bench.figures import Family, Point

STAT = Path("/proc/stat")
BUSY = 0.1  # processors used by other programs: more changes medians
UNSTEADY = 0.25  # distance of the quartiles over the median, for the median point
RISES = 1.02  # error of the last count over the least


class OtherLoad:
    """Measures the processors used by other programs, from its creation on."""

    def __init__(self) -> None:
        self._start = _counters()

    def cores(self) -> float | None:
        """Their mean number until now; None if the system does not report it."""
        before, now = self._start, _counters()
        if before is None or now is None or not now[0] > before[0]:
            return None
        seconds, busy, own = (b - a for a, b in zip(before, now, strict=True))
        return max(0.0, (busy - own) / seconds)


def _counters() -> tuple[float, float, float] | None:
    """Seconds of the clock, of all processors in use, and of those used by this process."""
    try:
        ticks = [float(word) for word in STAT.read_text().split("\n", 1)[0].split()[1:9]]
    except (OSError, ValueError):
        return None
    if len(ticks) < 8 or not any(ticks):
        return None
    user, nice, system, _idle, _waits, irq, soft_irq, stolen = ticks
    used = os.times()
    own = used.user + used.system + used.children_user + used.children_system
    busy = user + nice + system + irq + soft_irq + stolen
    return used.elapsed, busy / os.sysconf("SC_CLK_TCK"), own


def doubts_of(families: Sequence[Family], cores: float | None) -> tuple[str, ...]:
    """A sentence for each doubt about the figures.

    Args:
        families: the measured families.
        cores: processors used by other programs meanwhile; None if not known.
    """
    found = []
    if cores is not None and cores > BUSY:
        found.append(
            f"other programs used {cores:.1f} processors meanwhile: measure again on a quiet machine"
        )
    points = [point for family in families for point in family.points]
    spreads = [(point.cost.q3 - point.cost.q1) / point.cost.median for point in points]
    if spreads and (spread := float(np.median(spreads))) > UNSTEADY:
        found.append(f"times are unsteady: their quartiles lie {spread:.0%} of the median apart")
    strokes = next((family.points for family in families if family.name == "strokes"), ())
    return (*found, *_rise(strokes))


def _rise(points: Sequence[Point]) -> list[str]:
    """A doubt if the error of a brush is not least with all strokes."""
    if len(points) < 2:
        return []
    least, last = min(points, key=lambda point: point.error.rmse), points[-1]
    if not last.error.rmse > RISES * least.error.rmse:
        return []
    errors = f"{255 * least.error.rmse:.3g} to {255 * last.error.rmse:.3g} of 255"
    return [f"the error rises again beyond {least.strokes:,} strokes, from {errors} with {last.strokes:,}"]
