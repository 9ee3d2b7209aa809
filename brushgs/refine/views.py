"""Where the program looks from when it fits strokes to a scene: cameras of its own, no photographs needed.

Views to learn from lie evenly over a band of directions around the subject, those to judge by in between: no
view is both.
"""

import numpy as np

from brushgs.cameras.framing import DEFAULT_UP, default_elevation, direction_of, frame_scene, subject
from brushgs.scene import Camera, Gaussians

GOLDEN = (np.sqrt(5) - 1) / 2  # successive multiples of it fill a circle evenly, however many there are
BAND = np.radians(45.0)  # elevations seen: this much in all, the view of a picture in the middle
HIGHEST = np.radians(80.0)


def views_around(
    gaussians: Gaussians,
    num_views: int,
    *,
    width: int,
    height: int,
    up: str | tuple[float, float, float] = DEFAULT_UP,
    shift: float = 0.0,
) -> list[Camera]:
    """Views of the subject from all around, framed as a picture of it is.

    Args:
        gaussians: the scene, N >= 1.
        num_views: n >= 1.
        width: pixels.
        height: pixels.
        up: as `ViewConfig.up`.
        shift: of the whole set around the subject, in steps between its views; sets of other shifts in [0, 1)
            have no view in common.

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
        elevation = min(middle + BAND * (along - 0.5), HIGHEST)
        azimuth = 2 * np.pi * ((index + shift) * GOLDEN % 1.0)
        views.append(
            frame_scene(
                gaussians, width=width, height=height, up=direction, azimuth=azimuth, elevation=elevation
            )
        )
    return views
