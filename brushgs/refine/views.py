"""Cameras around a scene for refinement: training and validation views that need no photographs.

Both sets are spread evenly over the same range of directions around the subject; a shift keeps them apart.
"""

import numpy as np

from brushgs.cameras.framing import DEFAULT_UP, default_elevation, direction_of, frame_scene, subject
from brushgs.scene import Camera, Gaussians

GOLDEN_SHARE = (np.sqrt(5) - 1) / 2  # of a turn: any number of such steps are spread evenly over the circle
ELEVATION_RANGE = np.radians(45.0)  # from lowest to highest view; the default elevation is in the middle
MAX_ELEVATION = np.radians(80.0)


def views_around(
    gaussians: Gaussians,
    num_views: int,
    *,
    width: int,
    height: int,
    up: str | tuple[float, float, float] = DEFAULT_UP,
    shift: float = 0.0,
) -> list[Camera]:
    """Views of the subject from all around, framed by `frame_scene`.

    Args:
        gaussians: the scene, N >= 1.
        num_views: n >= 1.
        width: pixels.
        height: pixels.
        up: as `ViewConfig.up`.
        shift: of the whole set, in steps between its views, in [0, 1); different shifts share no view.

    Raises:
        ValueError: if a number is out of range or the scene is empty.
    """
    if num_views < 1:
        raise ValueError(f"views must be at least 1, got {num_views}")
    direction = direction_of(up)
    middle = default_elevation(subject(gaussians)[0], direction)
    views = []
    for index in range(num_views):
        along = (index + 0.5 + 0.5 * shift) / num_views % 1.0
        elevation = min(middle + ELEVATION_RANGE * (along - 0.5), MAX_ELEVATION)
        azimuth = 2 * np.pi * ((index + shift) * GOLDEN_SHARE % 1.0)
        views.append(
            frame_scene(
                gaussians, width=width, height=height, up=direction, azimuth=azimuth, elevation=elevation
            )
        )
    return views
