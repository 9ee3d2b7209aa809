"""Estimate the time and memory of a job from file headers."""

import os
import time
from collections.abc import Iterable, Mapping
from math import inf
from typing import NamedTuple

import numpy as np

from brushgs.options.painting import ClusterConfig
from brushgs.pipeline.blocks.budget import FOR_ALL, bytes_each
from brushgs.pipeline.explain import Explained

# Seconds of a step on two cores: minimum, per million Gaussians, and per 1,000 strokes. Fitted by eye to
# eight paintings of 14,000 to 180,000 Gaussians and 1,500 to 12,000 strokes, at the speed of `PROBE`. Four
# others, of two looks and all qualities, took 0.8 to 1.15 times the processor time of their estimates.
SECONDS: Mapping[str, tuple[float, float, float]] = {
    "own_brushes": (0.15, 0.0, 0.0),
    "read": (0.04, 0.5, 0.0),
    "cleaned": (0.08, 1.2, 0.0),
    "first_view": (0.45, 3.5, 0.0),
    "ground": (0.07, 0.0, 0.0),
    "plain_views": (0.45, 6.5, 0.05),  # with what clustering does with them
    "view_model": (0.2, 2.0, 0.0),
    "cut": (0.01, 0.8, 0.0),
    "pruned": (0.01, 1.3, 0.0),
    "focus": (0.06, 1.3, 0.0),
    "lens": (0.05, 1.5, 0.0),
    "drawn_lines": (1.2, 1.0, 0.0),
    "site": (0.1, 1.0, 0.0),
    "clustered": (0.05, 4.0, 0.06),
    "finished": (0.05, 0.0, 0.025),
    "staged": (0.18, 0.0, 0.0),
    "edged": (0.12, 0.3, 0.01),
    "graded_strokes": (0.1, 0.3, 0.006),
    "accents": (0.06, 1.5, 0.0),
    "coats": (0.04, 0.0, 0.033),
    "growth": (0.3, 3.0, 0.0),
    "followed": (1.0, 20.0, 0.0),
}
NEAR = 0.3  # share of `plain_views` without those around the scene
START = 0.4  # seconds before the first step: imports
FRAME = (0.05, 0.35, 0.01)  # of a frame: minimum, per million pixels, and per 1,000 strokes
PARALLEL = 0.3  # share of a painting's work that other processors take part in; of a frame all does
PROBE = 0.0019  # seconds that sorting `PROBED` numbers takes on the machine of the constants
PROBED = 200_000
PIXEL_BYTES = 1.5  # of a PNG of a painting
AUTO_STROKES = {"painting": 2500, "frame": 6000}  # medians of the knees of twelve scenes


class Estimate(NamedTuple):
    """Cost of a job.

    Attributes:
        seconds: on two cores.
        memory: bytes.
        written: bytes of the pictures.
    """

    seconds: float
    memory: int
    written: int

    @property
    def words(self) -> str:
        """Such as "about 4 s, 0.3 GB of memory, 1.4 MB written"."""
        memory, written = self.memory / 1e9, self.written / 1e6
        return f"about {self.seconds:.2g} s, {memory:.1f} GB of memory, {written:.1f} MB written"


def estimate(
    steps: Iterable[Explained],
    num_gaussians: int,
    num_terms: int,
    size: tuple[int, int],
    num_frames: int = 1,
    *,
    num_strokes: int = 6000,
    num_threads: int = 2,
    is_for_view: bool = False,
    most_held: float = inf,
) -> Estimate:
    """Estimate the cost of a job.

    Args:
        steps: of the job; undecided steps count half.
        num_gaussians: in its files.
        num_terms: spherical-harmonic terms of each.
        size: (width, height) of a frame, pixels.
        num_frames: number of painted frames.
        num_strokes: of the scene, see `strokes_of`.
        num_threads: processors that take part.
        is_for_view: whether strokes are made by the views near the picture alone.
        most_held: pixels of a frame beyond which it is painted in strips.
    """
    share = {"yes": 1.0, "undecided": 0.5, "no": 0.0}
    millions, thousands, pixels = num_gaussians / 1e6, num_strokes / 1e3, size[0] * size[1]
    scale = {"plain_views": NEAR} if is_for_view else {}
    costs = ((one, SECONDS.get(one.name, (0.0, 0.0, 0.0))) for one in steps)
    seconds = sum(
        share[one.runs] * scale.get(one.name, 1.0) * (least + millions * each + thousands * of_stroke)
        for one, (least, each, of_stroke) in costs
    )
    seconds = START + seconds * (1 + PARALLEL * (2 / num_threads - 1))
    frame = FRAME[0] + FRAME[1] * pixels / 1e6 + FRAME[2] * thousands
    seconds += num_frames * frame * 2 / num_threads
    memory = FOR_ALL + num_gaussians * bytes_each(num_terms) + round(60 * min(pixels, most_held))
    return Estimate(seconds, memory, round(num_frames * PIXEL_BYTES * pixels))


def strokes_of(config: ClusterConfig, num_gaussians: int) -> int:
    """The number of strokes of a painting of so many Gaussians, guessed where the scene decides."""
    asked = AUTO_STROKES[config.cost] if config.target is not None else config.num_strokes(num_gaussians)
    return min(asked, num_gaussians)


def slowness() -> float:
    """How many times longer work takes on this machine than on that of the constants, by a short test."""
    numbers = np.random.default_rng(0).random(PROBED)
    found = []
    for _ in range(5):
        start = time.thread_time()
        np.sort(numbers)
        found.append(time.thread_time() - start)
    return max(float(np.median(found)) / PROBE, 0.2)


def crowd() -> str:
    """What other programs add to an estimate, in words; "" if they leave this one a processor."""
    waiting, processors = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0, os.cpu_count() or 1
    if waiting < processors:
        return ""
    return f", and longer while other programs share its processors ({waiting:.0f} for {processors})"
