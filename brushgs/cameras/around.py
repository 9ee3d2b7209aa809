"""The views of a job: a few small views that strokes are made for, chosen once from the job's cameras.

Near views are the picture's own and three close to it, or some of a path; a ring of views covers the subject
from all around, so that strokes also suit other views. Sampled over three scenes and angles (dB at 0, 25 and
160 degrees from the picture), near views alone gave 26.1/25.3/22.9 (koala), 22.8/18.7/17.0 (truck), the ring
alone 25.6/25.4/25.6 and 21.1/21.0/20.3, both 26.0/25.7/25.5 and 22.3/21.3/20.3.

Views depend neither on the picture's resolution nor on the painted frame: pictures of other sizes, and all
frames of a path, have the same strokes.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from brushgs.cameras.framing import LookAt, frame_scene, point_of, points_of
from brushgs.cameras.motion import turns
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera, FirstView
from brushgs.values.frame import Frame

PIXELS = 120_000  # of each view: 400x300
MAX_SIDE = 4096  # pixels: limit for very wide or high pictures
MOST_OF_PATH = 12  # views taken from a path
# Turns of the camera about its target, degrees: to the right, and up.
NEAR = ((0.0, 0.0), (-12.0, 0.0), (12.0, 0.0), (0.0, 9.6))
Ring = Sequence[tuple[float, float]]
# Azimuth and elevation beyond those of the first view, degrees.
RING: Ring = (
    *((0.0, 0.0), (45.0, 8.0), (90.0, 0.0), (135.0, 8.0), (180.0, 0.0), (225.0, 8.0), (270.0, 0.0)),
    *((315.0, 8.0), (0.0, 35.0), (180.0, 35.0)),
)
# Views between these, not used for making strokes: they test strokes in unseen views.
HELD_OUT: Ring = ((22.5, 17.0), (112.5, 17.0), (202.5, 17.0), (292.5, 17.0))
MAX_ELEVATION = np.radians(86.0)  # of a turned view; azimuth is undefined straight from above
EMPTY = 0.02  # mean alpha below which a picture counts as empty


def small_view(camera: Camera) -> Camera:
    """The same view with about `PIXELS` pixels."""
    aspect = camera.width / camera.height
    sides = (PIXELS * aspect) ** 0.5, (PIXELS / aspect) ** 0.5
    width, height = (int(np.clip(round(side), 1, MAX_SIDE)) for side in sides)
    scale = np.diag([width / camera.width, height / camera.height, 1.0])
    return replace(camera, K=scale @ camera.K, width=width, height=height)


def near_views(camera: Camera, target: ArrayLike, up: ArrayLike | None = None) -> list[Camera]:
    """A view and three near it, turned about a point by 12 degrees to each side and 9.6 degrees up.

    Args:
        camera: the view.
        target: [3] the point, world units, such as from `point_ahead`; the camera's own position to turn it
            in place.
        up: [3] axis of turns to the side, world axes; None for that of the picture.

    Returns:
        Four cameras, the first with the given view.
    """
    view = small_view(camera)
    axis = -view.viewmat[1, :3] if up is None else np.asarray(up, np.float64)
    elevation = np.arcsin(np.clip(-view.viewmat[2, :3] @ axis / np.linalg.norm(axis), -1, 1))
    views = []
    for right, higher in NEAR:
        higher = np.radians(higher)
        if elevation + higher > MAX_ELEVATION:  # beyond the pole the view would flip
            higher = -higher
        views.append(turned(view, target, axis, np.radians(right), higher))
    return views


def path_views(cameras: Sequence[Camera]) -> list[Camera]:
    """At most `MOST_OF_PATH` of the cameras of a path, evenly spread from the first on."""
    num = min(len(cameras), MOST_OF_PATH)
    return [small_view(cameras[index * len(cameras) // num]) for index in range(num)]


def ring_views(
    view: FirstView, width: int, height: int, *, from_outside: bool = False, ring: Ring = RING
) -> list[Camera]:
    """Views of the whole subject of a scene from all around, ten by default, in the aspect of a picture.

    For a scene seen from inside, the camera turns in place.

    Args:
        view: of the scene; the ring starts with it.
        width: of the picture, pixels.
        height: of the picture, pixels.
        from_outside: put the ring around the subject even if the scene is seen from inside.
        ring: azimuth and elevation of each view beyond those of the first view, degrees.
    """
    look_at: LookAt | None = "subject" if from_outside else None
    views = []
    for right, higher in ring:
        elevation = min(view.elevation + np.radians(higher), max(MAX_ELEVATION, view.elevation))
        azimuth = view.azimuth + np.radians(right)
        camera = frame_scene(
            view, width=width, height=height, azimuth=azimuth, elevation=elevation, look_at=look_at
        )
        views.append(small_view(camera))
    return views


def turned(camera: Camera, target: ArrayLike, up: ArrayLike, right: float, higher: float = 0.0) -> Camera:
    """The camera turned about a point: about `up` to the viewer's right, then upward; radians."""
    if right == 0 and higher == 0:
        return camera
    point = np.asarray(target, np.float64)
    axes = np.stack([np.asarray(up, np.float64) / np.linalg.norm(up), camera.viewmat[0, :3]])
    turn = np.matmul(*turns(axes, np.array([right, -higher])))
    viewmat = np.eye(4)
    viewmat[:3, :3] = camera.viewmat[:3, :3] @ turn.T
    viewmat[:3, 3] = camera.viewmat[:3, :3] @ point + camera.viewmat[:3, 3] - viewmat[:3, :3] @ point
    return replace(camera, viewmat=viewmat)


def subject_ahead(camera: Camera, view: FirstView, look_at: LookAt | None = None) -> F64:
    """[3] point on the axis of a camera at the distance of its framing target."""
    point = point_of(look_at)
    if point is None:
        points = points_of(view, look_at)
        point = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return on_axis(camera, float(camera.viewmat[2, :3] @ point + camera.viewmat[2, 3]))


def point_ahead(camera: Camera, plain: Frame) -> F64:
    """[3] point on the axis of a camera at the median depth of its picture.

    Args:
        camera: the view.
        plain: its plain picture, with depth. For an empty picture the result is the camera's position.
    """
    assert plain.depth is not None, "render the plain picture with depth"
    alpha, depth = plain.alpha.astype(np.float64).ravel(), plain.depth.astype(np.float64).ravel()
    if not alpha.mean() > EMPTY:
        return camera.position
    order = np.argsort(depth, kind="stable")
    total = np.cumsum(alpha[order])
    return on_axis(camera, float(depth[order][np.searchsorted(total, 0.5 * total[-1])]))


def on_axis(camera: Camera, depth: float) -> F64:
    """[3] the point on the axis of a camera at a depth; not nearer than the near plane."""
    return np.asarray(camera.position + max(depth, camera.near) * camera.viewmat[2, :3])
