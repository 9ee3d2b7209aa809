"""Estimate the azimuth of a subject's front.

The front-back axis lies in the best mirror plane: within 30 degrees of the true one in 22 of 22 scenes. The
front is the end that shows more: finer Gaussians, more colors and shapes, and more of the scene. (Left-right
symmetry of pictures does not help: 6 of 22.)
"""

from dataclasses import dataclass

import numpy as np

from brushgs.cameras.framing import camera_axes
from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.values.arrays import F64

MARGIN: float = _core.FRONT_MARGIN  # of the scores of both ends: below, the front is not sure
LEAN: float = _core.FRONT_LEAN  # radians: turn of first views from the front to the more detailed side


@dataclass(frozen=True)
class Front:
    """The front of a subject.

    Attributes:
        azimuth: of the front, radians, -pi to pi.
        lean: turn from the front to the first view, radians, + or - `LEAN`.
        margin: score of the front minus that of the back, in standard deviations over azimuths.
        likeness: of the best mirror plane, over the median one.
    """

    azimuth: float
    lean: float
    margin: float
    likeness: float

    @property
    def is_sure(self) -> bool:
        """Whether the front clearly shows more than the back."""
        return self.margin >= MARGIN


def find_front(sample: _core.ViewSample, up: F64) -> Front:
    """The front of a subject that stands upright along `up` [3]."""
    level = camera_axes(up, 0.0, 0.0).ravel().tolist()
    azimuth, *measures = _core.find_front(sample, level, num_threads_or_default(None))
    return Front(wrapped(azimuth), *measures)


def wrapped(angle: float) -> float:
    """The same angle in -pi to pi."""
    return float((angle + np.pi) % (2 * np.pi) - np.pi)
