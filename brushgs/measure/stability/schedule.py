"""The schedule of a path: which frames are painted and compared, and how long each is kept."""

from collections.abc import Iterator
from math import gcd

import numpy as np

from brushgs.options.experiments import StabilityConfig

NUM_JUDGED = 12  # frames for SSIM and UIQM: each takes longer than painting a frame


class FrameSchedule:
    """The frames of a path that a `StabilityConfig` needs.

    Args:
        num_frames: see below.
        is_closed: see below.
        config: gaps, and number of comparisons.
        beat: period of hand-made changes in frames, see `Hand.beat`; pairs begin at all of its phases.

    Attributes:
        num_frames: frames of the path; a closed one repeats its first.
        is_closed: whether it does.
        gaps: the gaps that fit on the path, ascending.
        stride: from the first frame of a pair to that of the next.
        last_use: frame -> the last frame that it is compared with.
        painted: the frames that are painted, ascending.
        alone: painted frames that are painted a second time, ascending.
        judged: painted frames whose similarity to the plain picture is measured, ascending.
    """

    def __init__(self, num_frames: int, is_closed: bool, config: StabilityConfig, beat: int = 1) -> None:
        self.num_frames, self.is_closed = num_frames, is_closed
        self.gaps = [gap for gap in config.gaps if gap < num_frames]
        self.stride = -(-(num_frames - 1) // config.pairs)
        while gcd(self.stride, beat) > 1:
            self.stride += 1
        self.last_use: dict[int, int] = {}
        for gap in self.gaps:
            for start in self.starts(gap):
                for index in (start, start + gap):
                    self.last_use[index] = max(self.last_use.get(index, index), start + gap)
        if is_closed:
            self.last_use |= {0: num_frames - 1, num_frames - 1: num_frames - 1}
        self.painted = sorted(self.last_use)
        self.alone = self._spread(config.alone)
        self.judged = self._spread(NUM_JUDGED)

    def _spread(self, num: int) -> list[int]:
        """At most `num` painted frames, evenly distributed."""
        places = np.linspace(0, len(self.painted) - 1, min(num, len(self.painted)))
        return sorted({self.painted[round(place)] for place in places})

    def starts(self, gap: int) -> range:
        """The earlier frames of the pairs at a gap."""
        return range(0, self.num_frames - gap, self.stride)

    def pairs_ending(self, index: int) -> Iterator[tuple[int, int]]:
        """Gap and earlier frame of each pair whose later frame is `index`."""
        for gap in self.gaps:
            if index - gap in self.starts(gap):
                yield gap, index - gap
