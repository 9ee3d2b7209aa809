"""Cameras of a scene: its first view, changed by the user's options."""

from dataclasses import replace
from math import atan2, degrees, inf, nextafter, pi, radians
from typing import Any

import numpy as np

from brushgs.cameras.framing import AXES, frame_scene, unit_of
from brushgs.cameras.framing import plain_first_view as plain_first_view
from brushgs.cameras.orbit import orbit
from brushgs.options.painting import DEFAULT_SIZE, ViewConfig
from brushgs.options.table import row_of
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera
from brushgs.values.camera import FirstView as FirstView

_ROUNDINGS = 4  # rounds until a rounded unit vector is a fixed point
_TURNING = ("azimuth", "elevation", "side", "look_at", "distance", "pan", "roll", "fov_y", "zoom")
# Degrees from the front of the subject, to the viewer's right.
SIDES = {"front": 0.0, "right": 90.0, "back": 180.0, "left": -90.0, "top": 0.0}


def framed_camera(view: FirstView, config: ViewConfig) -> Camera:
    """The camera of options for a scene with this first view."""
    if view.photograph is not None and not is_turned(config):
        size = config.fixed_size
        camera = view.photograph.camera
        return camera if size is None else camera.resized(*size)
    return frame_scene(view, **framing(view, config))


def framed_orbit(view: FirstView, config: ViewConfig, num_frames: int) -> list[Camera]:
    """One turn that starts with the view of the options, see `orbit`."""
    return orbit(view, num_frames, **framing(view, config))


def is_turned(config: ViewConfig) -> bool:
    """Whether options change the view of a scene by more than the size of its picture."""
    return any(getattr(config, name) != row_of(ViewConfig, name).default for name in _TURNING)


def framing(view: FirstView, config: ViewConfig) -> dict[str, Any]:
    """The arguments of `frame_scene` for options; the up axis is that of the first view."""
    photograph = None if view.photograph is None else view.photograph.camera
    usual = DEFAULT_SIZE if photograph is None else (photograph.width, photograph.height)
    width, height = config.fixed_size or usual
    fov_y = config.fov_y
    if photograph is not None and fov_y == row_of(ViewConfig, "fov_y").default:
        fov_y = 2 * atan2(0.5 * photograph.height, float(photograph.K[1, 1]))
    azimuth, elevation, look_at = config.azimuth, config.elevation, config.look_at
    if config.side == "three-quarter":
        azimuth = view.azimuth
    elif config.side is not None:
        azimuth = radians(degrees(view.front) + SIDES[config.side])
        elevation = 0.5 * pi if config.side == "top" else elevation
    if config.side is not None and look_at is None:
        look_at = "subject"  # even if the scene is seen from inside
    return {
        "width": width,
        "height": height,
        "fov_y": fov_y,
        "azimuth": view.azimuth if azimuth is None else azimuth,
        "elevation": view.elevation if elevation is None else elevation,
        "zoom": config.zoom,
        "look_at": look_at,
        "distance": config.distance,
        "pan": config.pan,
        "roll": config.roll,
    }


def sayable(view: FirstView) -> FirstView:
    """The view rounded to short flags: tenths of a degree, four digits of an axis."""
    azimuth, elevation, front = (
        radians(round(degrees(angle), 1)) for angle in (view.azimuth, view.elevation, view.front)
    )
    up = view.up
    for _ in range(_ROUNDINGS):
        up = unit_of(_numbers_text(up, 4))
    return replace(view, up=up, azimuth=azimuth, elevation=min(max(elevation, -pi / 2), pi / 2), front=front)


def flags_of(view: FirstView, config: ViewConfig, *, with_up: bool = True) -> str:
    """The flags that reproduce a view, bit for bit if its angles were given in degrees.

    Args:
        view: of the scene.
        config: the options; its size is not part of the view.
        with_up: whether the up axis is among the flags.
    """
    options = framing(view, config)
    words = [f"--up {up_text(view.up)}"] if with_up else []
    words += [f"--{name} {degrees_text(options[name])}" for name in ("azimuth", "elevation")]
    if (look_at := options["look_at"]) is not None and (look_at != "subject" or view.eye is not None):
        words.append(f"--look-at {look_at if isinstance(look_at, str) else _numbers_text(look_at)}")
    if config.distance is not None:
        words.append(f"--distance {config.distance!r}")
    if config.pan != (0.0, 0.0):
        words.append(f"--pan {_numbers_text(config.pan)}")
    for name, angle in (("roll", config.roll), ("fov_y", config.fov_y)):
        row = row_of(ViewConfig, name)
        if angle != row.default:
            words.append(f"{row.flags[-1]} {degrees_text(angle)}")
    if config.zoom != 1:
        words.append(f"--zoom {config.zoom!r}")
    return " ".join(words)


def up_text(up: F64) -> str:
    """The text of --up that reproduces a unit vector [3], bit for bit if possible."""
    for name, axis in AXES.items():
        if np.array_equal(up, axis):
            return name
    texts = [_numbers_text(up, digits) for digits in (4, 8, None)]
    return next((text for text in texts if np.array_equal(unit_of(text), up)), texts[-1])


def degrees_text(angle: float) -> str:
    """The shortest number of degrees that converts to exactly this angle in radians, else the nearest."""
    near = degrees(angle)
    texts = [f"{near:.{digits}f}" for digits in range(13)]
    texts += [repr(number) for number in (near, nextafter(near, inf), nextafter(near, -inf))]
    return next((text for text in texts if radians(float(text)) == angle), repr(near))


def _numbers_text(numbers: Any, digits: int | None = None) -> str:
    """Numbers separated by commas, rounded to `digits` decimals, or exact."""
    values = [float(x) if digits is None else round(float(x), digits) for x in numbers]
    return ",".join(repr(x + 0.0).removesuffix(".0") for x in values)
