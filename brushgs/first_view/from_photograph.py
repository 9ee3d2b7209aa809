"""The first view of a scene that was predicted from one photograph: that of the photograph.

Such a scene is sound only near its camera: from the side, what the photograph did not show is a hole. How far
the camera may move to each side is found from the scene itself, by the holes that open.
"""

import numpy as np

from brushgs.cameras.around import point_ahead, turned
from brushgs.cameras.framing import angles_toward, plain_first_view, unit_of
from brushgs.options.painting import Up
from brushgs.rendering.plain import plain_views
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera, FirstView, Photograph
from brushgs.values.gaussians import Gaussians

SIDE = 160  # pixels of the longer side of the pictures
ANGLES = np.radians((12.0, 9.0, 6.0, 4.0, 2.0, 1.0))  # tried to each side, the widest first
HOLE, MOST_HOLES = 0.5, 0.02  # alpha below which a pixel is a hole, and the share of these


def view_of_photograph(gaussians: Gaussians, camera: Camera, *, up: Up | None = None) -> FirstView:
    """The view of a photograph.

    Args:
        gaussians: the scene, N >= 1.
        camera: that took the photograph.
        up: [3] axis about which the camera sways, world axes; None for that of the picture.

    Raises:
        ValueError: if there is no Gaussian, or `up` is not a direction.
    """
    down, forward = camera.viewmat[1, :3], camera.viewmat[2, :3]
    axis = -down if up is None else unit_of(up)
    view = plain_first_view(gaussians, tuple(float(x) for x in axis))
    small = camera.in_side(SIDE)
    pivot = point_ahead(small, plain_views(gaussians, [small], depth=True).frames[0])
    azimuth, elevation = (float(angle) + 0.0 for angle in angles_toward(axis, -forward))
    return FirstView(
        points=view.points,
        up=axis,
        azimuth=azimuth,
        elevation=elevation,
        eye=camera.position,
        has_surroundings=True,
        front=azimuth,
        whole=view.whole,
        photograph=Photograph(camera, pivot, _cone(gaussians, small, pivot, axis)),
    )


def _cone(gaussians: Gaussians, camera: Camera, pivot: F64, up: F64) -> float:
    """The widest angle of `ANGLES` at which both views have few holes; 0 if none has, radians."""
    for angle in ANGLES:
        cameras = [turned(camera, pivot, up, turn) for turn in (float(angle), -float(angle))]
        frames = plain_views(gaussians, cameras).frames
        if max(float((frame.alpha < HOLE).mean()) for frame in frames) <= MOST_HOLES:
            return float(angle)
    return 0.0
