"""What every camera format gives: the views of a file, and what a camera path states beside them."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from brushgs.values.arrays import F64
from brushgs.values.camera import Camera


@dataclass(frozen=True)
class Motion:
    """A camera that is known at every moment, as an animation is.

    Attributes:
        seconds: duration, > 0.
        at: its views at some moments, [T] seconds from the start, 0 to `seconds`.
    """

    seconds: float
    at: Callable[[F64], list[Camera]]

    def views(self, num_frames: int) -> list[Camera]:
        """Views equally far apart in time; the first and the last are the ends, of one it is the first."""
        return self.at(np.linspace(0.0, self.seconds, num_frames))


@dataclass(frozen=True)
class CameraFile:
    """What a camera file holds.

    Attributes:
        cameras: its views, >= 1, in the order of the file; those of a COLMAP model by the name of the image.
        keys: the key views that a camera path was made of; may be empty.
        fps: frames a second, if the file states it.
        is_loop: whether the file states that the first frame follows the last.
        names: of the pictures that the cameras took, as the file has them, one a camera; empty, also as a
            single name, where it has none.
        motion: of an animated camera, whose frames are `cameras`.
        choice: which camera of several this is, in words, such as "the animated camera 'Shot' of 3".
    """

    cameras: list[Camera]
    keys: list[Camera] = field(default_factory=list)
    fps: float | None = None
    is_loop: bool = False
    names: tuple[str, ...] = ()
    motion: Motion | None = None
    choice: str = ""
