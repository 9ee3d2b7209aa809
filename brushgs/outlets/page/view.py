"""Target, distance and up axis of the page's camera."""

from dataclasses import dataclass

import numpy as np

from brushgs.cameras.framing import LookAt, distance_ahead, point_of, points_of
from brushgs.cameras.orbit import middle_of
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera, FirstView

WITHIN = 98  # per cent of the points of a subject, which its reach holds
LEAST_DISTANCE = 0.05  # of the radius of the subject, from the camera to what it turns around


@dataclass(frozen=True, eq=False)
class PageView:
    """Facts on the subject for the camera of a page.

    Attributes:
        up: [3] unit vector, world axes.
        center: [3] target of the camera, world units: on the axis of the first camera, so that no pan is
            needed.
        radius: of the subject, world units, > 0.
        is_inside: whether the scene is seen from inside: the camera looks around and does not turn around it.
        subject: how far the subject reaches from the middle of the first view, to the sides and up and down,
            pixels; None where all of the picture is the subject.
    """

    up: F64
    center: F64
    radius: float
    is_inside: bool
    subject: tuple[float, float] | None = None

    @classmethod
    def of(cls, first_view: FirstView, camera: Camera, look_at: LookAt | None = None) -> "PageView":
        """The facts for a first camera.

        Args:
            first_view: of the scene.
            camera: that of the first view of the page.
            look_at: framing target of the camera, see `frame_scene`; None for the default.
        """
        is_inside = first_view.eye is not None and look_at is None
        points = points_of(first_view, look_at)
        forward = camera.viewmat[2, :3]
        middle = middle_of(points, first_view.up)
        radius = max(float(np.linalg.norm(points - middle, axis=1).max()), 1e-9)
        if is_inside:
            distance = distance_ahead(first_view, camera.viewmat[:3, :3])
        else:
            point = point_of(look_at)
            distance = float((np.asarray(middle if point is None else point) - camera.position) @ forward)
        distance = max(distance, LEAST_DISTANCE * radius)
        subject = None if is_inside else reach_in(camera, points)
        return cls(first_view.up, camera.position + distance * forward, radius, is_inside, subject)


def reach_in(camera: Camera, points: F64) -> tuple[float, float] | None:
    """How far nearly all points [m, 3] are from the middle of a picture, pixels; None if it holds but few."""
    seen = points @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
    seen = seen[seen[:, 2] > camera.near]
    if len(seen) < 0.5 * len(points) or not len(seen):
        return None
    places = np.abs((seen @ camera.K.T)[:, :2] / seen[:, 2:] - 0.5 * np.array([camera.width, camera.height]))
    across, down = np.minimum(np.percentile(places, WITHIN, axis=0), [camera.width / 2, camera.height / 2])
    return max(float(across), 1.0), max(float(down), 1.0)
