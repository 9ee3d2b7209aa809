"""Cameras around a scene for refinement: training and validation views that need no photographs.

Both sets are spread evenly over the same range of directions around the subject; a shift keeps them apart.
"""

import numpy as np
from numpy.typing import ArrayLike

from brushgs.cameras.framing import first_view_of, frame_scene
from brushgs.cameras.orbit import orbit
from brushgs.scene import Camera, FirstView, Gaussians

GOLDEN_SHARE = (np.sqrt(5) - 1) / 2  # of a turn: any number of such steps are spread evenly over the circle
ELEVATION_RANGE = np.radians(45.0)  # from lowest to highest view; the default elevation is in the middle
MAX_ELEVATION = np.radians(80.0)


def views_around(
    scene: Gaussians | FirstView,
    num_views: int,
    *,
    width: int,
    height: int,
    up: str | ArrayLike | None = None,
    shift: float = 0.0,
) -> list[Camera]:
    """Views of the subject from all around, framed by `frame_scene`; of a scene seen from inside, a sway.

    Args:
        scene: N Gaussians, N >= 1, or the first view of a scene, see `frame_scene`.
        num_views: n >= 1.
        width: pixels.
        height: pixels.
        up: see `frame_scene`.
        shift: of the whole set, in steps between its views, in [0, 1); different shifts share no view.

    Raises:
        ValueError: if a number is out of range.
    """
    if num_views < 1:
        raise ValueError(f"views must be at least 1, got {num_views}")
    view = first_view_of(scene, up)
    if view.eye is not None:
        return orbit(view, 2 * num_views, width=width, height=height)[shift > 0 :: 2]
    views = []
    for index in range(num_views):
        along = (index + 0.5 + 0.5 * shift) / num_views % 1.0
        elevation = min(view.elevation + ELEVATION_RANGE * (along - 0.5), MAX_ELEVATION)
        azimuth = 2 * np.pi * ((index + shift) * GOLDEN_SHARE % 1.0)
        views.append(frame_scene(view, width=width, height=height, azimuth=azimuth, elevation=elevation))
    return views
