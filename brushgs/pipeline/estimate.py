"""Estimate the time and memory of a job from file headers."""

from collections.abc import Iterable
from math import inf
from typing import NamedTuple

from brushgs.pipeline.blocks.budget import FOR_ALL, bytes_each
from brushgs.pipeline.explain import Explained

# Seconds of a step on two cores: minimum, and per million Gaussians. Fitted by eye to five scenes of 14,000
# to 150,000 Gaussians; a job is within a factor of two of the sum.
SECONDS = {
    "own_brushes": (0.15, 0.0),
    "read": (0.02, 1.0),
    "cleaned": (0.1, 3.0),
    "first_view": (0.5, 4.0),
    "ground": (0.1, 0.0),
    "plain_views": (0.1, 3.0),
    "view_model": (0.2, 2.0),
    "cut": (0.03, 0.8),
    "pruned": (0.05, 1.3),
    "focus": (0.1, 1.0),
    "lens": (0.05, 1.5),
    "drawn_lines": (1.2, 1.0),
    "key": (0.1, 0.5),
    "clustered": (1.0, 9.0),
    "staged": (0.1, 0.0),
    "edged": (0.2, 0.0),
    "graded_strokes": (0.2, 0.0),
    "accents": (0.15, 0.5),
    "growth": (0.3, 3.0),
    "followed": (1.0, 20.0),
}
FRAME = (0.05, 0.35)  # seconds of a frame: minimum, and per million pixels
PIXEL_BYTES = 1.5  # of a PNG of a painting


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
    most_held: float = inf,
) -> Estimate:
    """Estimate the cost of a job.

    Args:
        steps: of the job; undecided steps count half.
        num_gaussians: in its files.
        num_terms: spherical-harmonic terms of each.
        size: (width, height) of a frame, pixels.
        num_frames: number of painted frames.
        most_held: pixels of a frame beyond which it is painted in strips.
    """
    share = {"yes": 1.0, "undecided": 0.5, "no": 0.0}
    millions, pixels = num_gaussians / 1e6, size[0] * size[1]
    costs = ((share[step.runs], SECONDS.get(step.name, (0.0, 0.0))) for step in steps)
    seconds = sum(part * (least + millions * each) for part, (least, each) in costs)
    seconds += num_frames * (FRAME[0] + FRAME[1] * pixels / 1e6)
    memory = FOR_ALL + num_gaussians * bytes_each(num_terms) + round(60 * min(pixels, most_held))
    return Estimate(seconds, memory, round(num_frames * PIXEL_BYTES * pixels))
