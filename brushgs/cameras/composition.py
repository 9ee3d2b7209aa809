"""Composition: format of the picture, and position and size of the subject in it.

The format follows the proportions of the subject with its shadow. The subject gets room on the side that it
faces and where its shadow falls, and stands below the middle. The camera keeps its lens and steps back.

Like all framing it depends only on a `FirstView`, so that strokes are composed like their scene.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import floor, log, log10, radians, sin, tan

import numpy as np
from numpy.typing import ArrayLike

from brushgs.cameras.first_view import framing
from brushgs.cameras.framing import FLAT_ELEVATION, camera_axes, default_elevation, fit_eye, rolled
from brushgs.options.painting import DEFAULT_SIZE, ViewConfig
from brushgs.options.paper import PaperSize
from brushgs.values.arrays import F64
from brushgs.values.camera import FirstView

# About 921,600 pixels each, as many as 1280x720.
_Size = tuple[int, int] | PaperSize
SIZES: Sequence[_Size] = ((784, 1176), (858, 1074), (960, 960), (1074, 858), (1108, 832), (1280, 720))
TO_PICTURE = 0.6  # exponent between the proportions of a subject with its shadow and those of its picture
FILL = 0.68  # share of the picture's width or height, whichever binds, filled by the subject
FEET, LOW_FEET = 0.88, 0.82  # lower end of a tall and of a low subject, share of the height from the top
TALL, LOW = 0.55, 0.25  # heights of tall and low subjects, as shares of the picture
LEVEL, STEEP = radians(45.0), radians(75.0)  # elevations: the anchor moves from the feet to the middle
SHADOW = 0.65  # share of a shadow, from the foot, that the format includes
TO_GAZE, TO_SHADOW = 0.05, 0.04  # shifts to make room on one side, shares of the width
LEAST_ROOM = 0.07  # of the width, left beside it
DIGITS = 4  # rounding of the camera position: significant digits relative to the subject's size
_STEPS = 60  # of Newton's method


@dataclass(frozen=True, eq=False)
class _Subject:
    """An isolated subject before a camera of known direction.

    Attributes:
        points: [n, 3] its outline in camera axes: right, down, ahead.
        shadow: [m, 3] the part of its shadow to include; empty without a lamp.
        tangents: [2] of half the angle of view of a square picture.
        elevation: of the camera, radians.
        give_way: shift to the right to make room, share of the width.
    """

    points: F64
    shadow: F64
    tangents: F64
    elevation: float
    give_way: float


def composed(view: FirstView, config: ViewConfig, lamp: ArrayLike | None = None) -> ViewConfig:
    """The options of a view with a suitable size, and the position of the camera.

    Isolated subjects are composed. Scenes that fill the picture (rooms, land from the air, subjects in
    surroundings), and subjects placed by the options, are as large as fits.

    Args:
        view: of the scene.
        config: the options; of `size` only a paper size counts, for the orientations that it allows.
        lamp: [3] direction toward the light that casts the shadow, world axes; None for no shadow.
    """
    sizes: Sequence[_Size] = config.size.turns if isinstance(config.size, PaperSize) else SIZES
    size: _Size = DEFAULT_SIZE if sizes is SIZES else sizes[0]
    if view.eye is None and not view.has_surroundings and config.look_at in (None, "subject"):
        subject = _subject(view, config, lamp)
        is_flat = default_elevation(view.points, view.up) == FLAT_ELEVATION
        size = _format(subject, 1.0 if is_flat else TO_PICTURE, sizes)
        if not is_flat:
            return _set_into(subject, replace(config, size=size), view)
    return replace(config, size=size)


def format_name(width: int, height: int) -> str:
    """The format of a picture in words: portrait, square or landscape."""
    return "square" if width == height else "portrait" if width < height else "landscape"


def _axes(view: FirstView, config: ViewConfig) -> F64:
    """[3, 3] camera axes (rows right, down, ahead) of the options."""
    options = framing(view, config)
    return rolled(camera_axes(view.up, options["azimuth"], options["elevation"]), config.roll)


def _subject(view: FirstView, config: ViewConfig, lamp: ArrayLike | None) -> _Subject:
    axes, options = _axes(view, config), framing(view, config)
    give_way = 0.0
    if config.azimuth is None:  # otherwise the front is unknown
        give_way -= TO_GAZE * sin(view.front - options["azimuth"])
    shadow = np.zeros((0, 3))
    if lamp is not None:
        light = np.asarray(lamp, np.float64)
        shadow = _shadow(view, light) @ axes.T
        give_way += TO_SHADOW * float(axes[0] @ light) / float(np.linalg.norm(light))
    half = tan(0.5 * config.fov_y)
    return _Subject(view.points @ axes.T, shadow, np.array([half, half]), options["elevation"], give_way)


def _shadow(view: FirstView, light: F64) -> F64:
    """[n, 3] the near part of the subject's shadow on its ground level, world units."""
    heights = view.points @ view.up
    heights = heights - heights.min()
    rise = float(light @ view.up)
    if rise <= 0.1 * float(np.linalg.norm(light)):
        return np.zeros((0, 3))
    level = light - rise * view.up
    return np.asarray(view.points - heights[:, None] * (view.up + SHADOW / rise * level))


def _format(subject: _Subject, exponent: float, sizes: Sequence[_Size]) -> _Size:
    """The size nearest to the framed proportions raised to `exponent`."""
    eye, _ = fit_eye(subject.points, FILL * subject.tangents)
    low, high = _box(np.concatenate([subject.points, subject.shadow]), eye, subject.tangents)
    wide, tall = np.maximum(high - low, 1e-9)
    wanted = exponent * log(wide / tall)

    def off(size: _Size) -> float:
        width, height = size.pixels if isinstance(size, PaperSize) else size
        return abs(log(width / height) - wanted)

    return min(sizes, key=off)


def _set_into(subject: _Subject, config: ViewConfig, view: FirstView) -> ViewConfig:
    """The options with look-at point and distance of the composition."""
    assert config.fixed_size is not None, "choose a format first"
    width, height = config.fixed_size
    tangents = subject.tangents * (width / height, 1.0)
    eye, away = fit_eye(subject.points, tangents)
    middle, front = eye[2] + away, float(subject.points[:, 2].min())
    for _ in range(_STEPS):
        low, high = _box(subject.points, eye, tangents)
        place = _place(high - low, subject)
        eye = _moved(subject.points, eye, tangents, place)
        eye[2] = front - (front - eye[2]) * float((high - low).max()) / FILL
    if config.zoom != 1:  # about the subject, not about the middle
        for _ in range(_STEPS):
            eye = _moved(subject.points, eye, tangents / config.zoom, place)
    away = float(middle - eye[2])
    digits = DIGITS - floor(log10(max(float(np.ptp(subject.points, axis=0).max()), 1e-300)))
    point = np.array([*eye[:2], eye[2] + away]) @ _axes(view, config)
    x, y, z = (round(float(number), digits) for number in point)
    return replace(config, look_at=(x, y, z), distance=round(away, digits))


def _place(extent: F64, subject: _Subject) -> F64:
    """[2] position of the middle of a subject with this extent [2], shares of the picture."""
    wide, tall = extent
    room = max(0.5 - 0.5 * wide - LEAST_ROOM, 0.0)
    aside = float(np.clip(subject.give_way, -room, room))
    is_low = float(np.clip((TALL - tall) / (TALL - LOW), 0, 1))
    is_steep = float(np.clip((subject.elevation - LEVEL) / (STEEP - LEVEL), 0, 1))
    stands = FEET + is_low * (LOW_FEET - FEET) - 0.5 * tall
    return np.array([0.5 + aside, stands + is_steep * (0.5 - stands)])


def _moved(points: F64, eye: F64, tangents: F64, place: F64) -> F64:
    """The eye [3] moved so that the middle of the points' bounds approaches a place [2] in the picture.

    One step of Newton's method.
    """
    seen, scale = _seen(points, eye, tangents)
    ends = np.stack([seen.argmin(axis=0), seen.argmax(axis=0)])
    middle, by_eye = (0.5 * np.take_along_axis(each, ends, axis=0).sum(axis=0) for each in (seen, scale))
    return np.asarray(eye + np.array([*((middle - place) / by_eye), 0.0]))


def _box(points: F64, eye: F64, tangents: F64) -> tuple[F64, F64]:
    """[2], [2] bounds of points in shares of the picture, from its upper left corner."""
    seen, _ = _seen(points, eye, tangents)
    return seen.min(axis=0), seen.max(axis=0)


def _seen(points: F64, eye: F64, tangents: F64) -> tuple[F64, F64]:
    """[n, 2] positions of points in shares of the picture, and [n, 2] their shift per unit of the eye."""
    scale = 0.5 / ((points[:, 2:] - eye[2]) * tangents)
    return 0.5 + (points[:, :2] - eye[:2]) * scale, scale
