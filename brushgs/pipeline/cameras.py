"""Cameras for Gaussians in memory: `frame_scene` and `orbit`, framed as by `brushgs render`.

Both estimate the first view of the scene (`pipeline.views`) and apply options to it (`cameras.first_view`).
"""

import warnings
from collections.abc import Mapping
from math import degrees, radians
from typing import Any

from brushgs.cameras.first_view import framed_camera, framed_orbit
from brushgs.cameras.framing import LookAt
from brushgs.options.choices import Side, Target
from brushgs.options.painting import DEFAULT_SIZE, Up, ViewConfig
from brushgs.pipeline.report import Report
from brushgs.pipeline.views import default_first_view
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians


def frame_scene(
    gaussians: Gaussians,
    *,
    width: int = DEFAULT_SIZE[0],
    height: int = DEFAULT_SIZE[1],
    up: Up | None = None,
    azimuth_deg: float | None = None,
    elevation_deg: float | None = None,
    side: Side | None = None,
    zoom: float = 1.0,
    fov_deg: float = 50.0,
    look_at: LookAt | None = None,
    distance: float | None = None,
    pan: tuple[float, float] = (0.0, 0.0),
    roll_deg: float = 0.0,
    **old: float,
) -> Camera:
    """A camera that shows a scene upright, from its front, with the whole subject as large as fits.

    `paint` and `brushgs render` use this camera if only a size is given; without a size they also choose the
    format and compose the subject. Up axis, front and subject are estimated from the Gaussians, in about half
    a second for 100,000. For strokes, use the camera of their scene.

    Args:
        gaussians: N Gaussians of a scene, N >= 1.
        width: of the picture, pixels.
        height: of the picture, pixels.
        up: up axis in world axes: "+x" to "-z" or three numbers; None estimates it.
        azimuth_deg: camera position around the up axis, degrees to the viewer's right from a fixed direction,
            see `brushgs.cameras.framing.frame_scene`; None for a three-quarter view of the front.
        elevation_deg: degrees above the horizon, -90 to 90; None for 15, or 40 above flat ground.
        side: side of the subject to show, in place of an azimuth: "front", "left", "back", "right", "top" or
            "three-quarter".
        zoom: 1 shows the whole subject, 2 twice as large, > 0.
        fov_deg: vertical field of view, degrees, in (0, 180).
        look_at: what to frame: "subject", "scene" (with all surroundings), "part" (the upper third of the
            subject), or a point [3] to center, world units. None for the subject, or for scenes seen from
            inside the view from there.
        distance: from the camera to that point, world units, > 0; None for that which shows the whole
            subject.
        pan: (right, up) shift of the camera without turning, in shares of the picture.
        roll_deg: rotation of the scene in the picture, degrees clockwise.
        **old: `azimuth`, `elevation`, `fov_y` and `roll` in radians, as before version 0.2; gives a
            DeprecationWarning.

    Raises:
        ValueError: if there is no Gaussian, or an option is out of range.

    Example:
        >>> bg.frame_scene(gaussians, width=640, height=480, side="front")
        Camera(640x480, 50 degrees high, at ...)
    """
    view = ViewConfig(
        size=(width, height),
        up=up,
        side=side,
        zoom=zoom,
        look_at=_target(look_at),
        distance=distance,
        pan=pan,
        **_radians(
            "frame_scene", old, azimuth=azimuth_deg, elevation=elevation_deg, fov_y=fov_deg, roll=roll_deg
        ),
    )
    return framed_camera(_first_view("frame_scene", gaussians, up), view)


def orbit(
    gaussians: Gaussians,
    num_frames: int,
    *,
    width: int = DEFAULT_SIZE[0],
    height: int = DEFAULT_SIZE[1],
    up: Up | None = None,
    azimuth_deg: float | None = None,
    elevation_deg: float | None = None,
    side: Side | None = None,
    zoom: float = 1.0,
    fov_deg: float = 50.0,
    look_at: LookAt | None = None,
    distance: float | None = None,
    pan: tuple[float, float] = (0.0, 0.0),
    roll_deg: float = 0.0,
    **old: float,
) -> list[Camera]:
    """One turn around a scene: a loop at constant distance, in even steps, with a level horizon.

    The path of `brushgs render --orbit`. The first camera looks in the direction of `frame_scene`, from as
    far away as needed to show the whole subject in every view. For a scene seen from inside, the camera sways
    on a small circle instead.

    Args:
        gaussians: N Gaussians of a scene, N >= 1.
        num_frames: >= 1; frame i is turned by i / num_frames of a full turn.
        width: see `frame_scene`, as for all below.
        height: pixels.
        up: None estimates it.
        azimuth_deg: of the first view; it grows along the orbit.
        elevation_deg: of all views.
        side: shown by the first view.
        zoom: of all views.
        fov_deg: degrees.
        look_at: the orbit is around its middle.
        distance: from the camera to a point `look_at`.
        pan: of all views.
        roll_deg: of all views.
        **old: angles in radians, see `frame_scene`.

    Raises:
        ValueError: as `frame_scene` does, or if `num_frames` is below 1.

    Example:
        >>> cameras = bg.orbit(gaussians, 120, width=320, height=240)
        >>> len(cameras)
        120
    """
    view = ViewConfig(
        size=(width, height),
        up=up,
        side=side,
        zoom=zoom,
        look_at=_target(look_at),
        distance=distance,
        pan=pan,
        **_radians("orbit", old, azimuth=azimuth_deg, elevation=elevation_deg, fov_y=fov_deg, roll=roll_deg),
    )
    return framed_orbit(_first_view("orbit", gaussians, up), view, num_frames)


def _radians(where: str, old: Mapping[str, float], **in_degrees: float | None) -> dict[str, Any]:
    """Angles in radians by field name of `ViewConfig`; old keywords are in radians already."""
    for name in old:
        if name not in in_degrees:
            raise TypeError(f"{where}() has no keyword {name!r}")
        new = f"{name.removesuffix('_y')}_deg"
        message = f"{where}: {name} in radians is now {new} in degrees; write {new}={degrees(old[name]):g}"
        warnings.warn(message, DeprecationWarning, stacklevel=3)
    return {name: None if x is None else radians(x) for name, x in in_degrees.items()} | dict(old)


def _first_view(where: str, gaussians: Gaussians, up: Up | None) -> FirstView:
    if len(gaussians) == 0:
        raise ValueError(f"{where}: gaussians must have at least one row, got none")
    return default_first_view(gaussians, None, Report(), up=up)


def _target(look_at: LookAt | None) -> Target | tuple[float, float, float] | None:
    if look_at is None or isinstance(look_at, str):
        return look_at
    x, y, z = map(float, look_at)
    return x, y, z
