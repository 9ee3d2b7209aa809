"""Cameras around a scene for refinement: generated training and validation views.

Both sets are spread evenly over the same directions around the subject, with a shift between them; for clips
also over the moments.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from brushgs.cameras.framing import first_view_of, frame_scene
from brushgs.cameras.orbit import orbit
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians

GOLDEN_SHARE = (np.sqrt(5) - 1) / 2  # of a turn: any number of steps is spread evenly over the circle
# For the moments of a clip: 1 over the real root of x^3 = x + 1, rationally independent of the golden
# section, so that views fill directions and moments evenly together (Weyl 1916).
PLASTIC_SHARE = 0.7548776662466927
OWN_VIEWS = 4  # one view in this many is from the camera of the clip
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
        shift: of the set, in steps between views, in [0, 1); different shifts share no view.

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


class TimedView(NamedTuple):
    """A view, and its moment of a clip.

    Attributes:
        camera: the view.
        moment: index into the moments of the clip; None for a still scene.
    """

    camera: Camera
    moment: int | None = None


def views_over_time(
    scene: Gaussians | FirstView,
    num_views: int,
    num_moments: int,
    *,
    width: int,
    height: int,
    own: Camera | None = None,
    shift: float = 0.0,
) -> list[TimedView]:
    """Views of the subject of a clip from all around, spread evenly over directions and moments together.

    Args:
        scene: see `views_around`.
        num_views: n >= 1.
        num_moments: T >= 1.
        width: pixels.
        height: pixels.
        own: the camera of the clip: one view in four uses it, at least the first, spread evenly over the
            moments. Or None.
        shift: see `views_around`.

    Raises:
        ValueError: if a number is out of range.
    """
    if num_moments < 1:
        raise ValueError(f"moments must be at least 1, got {num_moments}")
    num_own = 0 if own is None else -(-num_views // OWN_VIEWS)
    num_around = num_views - num_own
    cameras = (
        views_around(scene, num_around, width=width, height=height, shift=shift)
        if num_around or own is None
        else []
    )
    views = []
    if own is not None:
        views = [TimedView(own, int((index + 0.5) / num_own * num_moments)) for index in range(num_own)]
    for index, camera in enumerate(cameras):
        share = (0.5 + (index + shift) * PLASTIC_SHARE) % 1.0
        views.append(TimedView(camera, min(int(share * num_moments), num_moments - 1)))
    return views
