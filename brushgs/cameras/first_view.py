"""The first view of a scene: which way is up, from where it is seen, and what is framed.

`FirstView` is all that the cameras of a scene depend on beside the options of the user, so strokes that carry
the first view of their scene are seen by the very same cameras.
"""

from dataclasses import dataclass

import numpy as np

from brushgs.arrays import F64
from brushgs.cameras.framing import DEFAULT_AZIMUTH, default_elevation, subject
from brushgs.scene import Gaussians


@dataclass(frozen=True, eq=False)
class FirstView:
    """How a scene is seen where the user gives no view.

    Attributes:
        points: [m, 3] points of the subject, float64, world units: the vertices of its convex hull, which is
            all that framing depends on.
        up: [3] unit vector, world axes.
        azimuth: radians, see `frame_scene`.
        elevation: radians above the horizon.
        eye: [3] where a scene is seen from inside: position of the camera, which looks along azimuth and
            elevation; None if the subject is framed from outside.
        has_surroundings: whether the scene is more than its subject.
        probability: that `up` is right, 0 to 1; None where it was not estimated but stated.
        ups: the six axes with their probabilities, the most probable first; empty where up was stated.
    """

    points: F64
    up: F64
    azimuth: float
    elevation: float
    eye: F64 | None = None
    has_surroundings: bool = False
    probability: float | None = None
    ups: tuple[tuple[str, float], ...] = ()


def plain_first_view(gaussians: Gaussians, up: F64) -> FirstView:
    """The first view without an estimate: the default azimuth and elevation for a stated up [3].

    Raises:
        ValueError: if there is no Gaussian.
    """
    from scipy.spatial import ConvexHull, QhullError

    points, has_surroundings = subject(gaussians)
    try:
        points = points[ConvexHull(points).vertices]
    except (QhullError, ValueError):  # fewer than four points, or all in one plane
        points = np.unique(points, axis=0)
    elevation = default_elevation(points, up)
    return FirstView(points, up / np.linalg.norm(up), DEFAULT_AZIMUTH, elevation, None, has_surroundings)
