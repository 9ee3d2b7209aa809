"""How a subject stands in its picture: the format of the picture, and the place and size in it.

A painter chooses the canvas by what stands on it and by what it throws on the table, leaves room where the
subject looks and where its shadow falls, and sets it below the middle. The camera keeps its lens and steps
back: seen from farther away things are calmer.

Like all framing it depends on a `FirstView` alone, so that strokes are composed as their scene.
"""

from dataclasses import dataclass, replace
from math import floor, log, log10, radians, sin, tan

import numpy as np
from numpy.typing import ArrayLike

from brushgs.cameras.first_view import framing
from brushgs.cameras.framing import FLAT_ELEVATION, camera_axes, default_elevation, fit_eye, rolled
from brushgs.options.painting import DEFAULT_SIZE, ViewConfig
from brushgs.values.arrays import F64
from brushgs.values.camera import FirstView

# Of some 921,600 pixels each, as many as 1280x720 has.
SIZES = ((784, 1176), (858, 1074), (960, 960), (1074, 858), (1108, 832), (1280, 720))
TO_PICTURE = 0.6  # exponent between the proportions of a subject with its shadow and those of its picture
FILL = 0.68  # of the picture's width or height, whichever binds, that the subject takes
FEET, LOW_FEET = 0.88, 0.82  # of the height, from the top, where a tall and a low subject end
TALL, LOW = 0.55, 0.25  # shares of the height that these take
LEVEL, STEEP = radians(45.0), radians(75.0)  # elevations between which the feet give way to the middle
SHADOW = 0.65  # of a shadow, from the foot, that the format has room for
TO_GAZE, TO_SHADOW = 0.05, 0.04  # of the width, by which a subject makes room on one side
LEAST_ROOM = 0.07  # of the width, left beside it
DIGITS = 4  # of the place of the camera, in which the size of the subject has one
_STEPS = 60  # until a subject is where it is to be


@dataclass(frozen=True, eq=False)
class _Subject:
    """What stands in a void, before a camera whose direction is known.

    Attributes:
        points: [n, 3] its outline in camera axes: right, down, ahead.
        shadow: [m, 3] the part of its shadow that there is to be room for; none without a lamp.
        tangents: [2] of half the angle of view of a picture as wide as high.
        elevation: of the camera, radians.
        give_way: share of the width, to the right, by which it stands aside.
    """

    points: F64
    shadow: F64
    tangents: F64
    elevation: float
    give_way: float


def composed(view: FirstView, config: ViewConfig, lamp: ArrayLike | None = None) -> ViewConfig:
    """The options of a view with the size that suits it, and the place of the camera.

    A subject that stands in a void is set into the picture. What fills it, as a room, land from the air or a
    subject in surroundings does, or is placed by the options, is as large as fits.

    Args:
        view: of the scene.
        config: the options; `size` counts for nothing.
        lamp: [3] direction toward the light in world axes, which throws a shadow; None for no shadow.
    """
    size = DEFAULT_SIZE
    if view.eye is None and not view.has_surroundings and config.look_at in (None, "subject"):
        subject = _subject(view, config, lamp)
        is_flat = default_elevation(view.points, view.up) == FLAT_ELEVATION
        size = _format(subject, 1.0 if is_flat else TO_PICTURE)
        if not is_flat:
            return _set_into(subject, replace(config, size=size), view)
    return replace(config, size=size)


def format_name(width: int, height: int) -> str:
    """The format of a picture in words: portrait, square or landscape."""
    return "square" if width == height else "portrait" if width < height else "landscape"


def _axes(view: FirstView, config: ViewConfig) -> F64:
    """[3, 3] rows right, down and ahead of the camera that options mean."""
    options = framing(view, config)
    return rolled(camera_axes(view.up, options["azimuth"], options["elevation"]), config.roll)


def _subject(view: FirstView, config: ViewConfig, lamp: ArrayLike | None) -> _Subject:
    axes, options = _axes(view, config), framing(view, config)
    give_way = 0.0
    if config.azimuth is None:  # else no front was searched
        give_way -= TO_GAZE * sin(view.front - options["azimuth"])
    shadow = np.zeros((0, 3))
    if lamp is not None:
        light = np.asarray(lamp, np.float64)
        shadow = _shadow(view, light) @ axes.T
        give_way += TO_SHADOW * float(axes[0] @ light) / float(np.linalg.norm(light))
    half = tan(0.5 * config.fov_y)
    return _Subject(view.points @ axes.T, shadow, np.array([half, half]), options["elevation"], give_way)


def _shadow(view: FirstView, light: F64) -> F64:
    """[n, 3] the nearer part of the shadow on the level on which a subject stands, world units."""
    heights = view.points @ view.up
    heights = heights - heights.min()
    rise = float(light @ view.up)
    if rise <= 0.1 * float(np.linalg.norm(light)):
        return np.zeros((0, 3))
    level = light - rise * view.up
    return np.asarray(view.points - heights[:, None] * (view.up + SHADOW / rise * level))


def _format(subject: _Subject, exponent: float) -> tuple[int, int]:
    """The size of `SIZES` whose proportions are nearest to those of what is framed, to a power."""
    eye, _ = fit_eye(subject.points, FILL * subject.tangents)
    low, high = _box(np.concatenate([subject.points, subject.shadow]), eye, subject.tangents)
    wide, tall = np.maximum(high - low, 1e-9)
    wanted = exponent * log(wide / tall)
    return min(SIZES, key=lambda size: abs(log(size[0] / size[1]) - wanted))


def _set_into(subject: _Subject, config: ViewConfig, view: FirstView) -> ViewConfig:
    """The options with the camera before the point, and at the distance, from which a subject stands well."""
    assert isinstance(config.size, tuple), "choose a format first"
    width, height = config.size
    tangents = subject.tangents * (width / height, 1.0)
    eye, away = fit_eye(subject.points, tangents)
    middle, front = eye[2] + away, float(subject.points[:, 2].min())
    for _ in range(_STEPS):
        low, high = _box(subject.points, eye, tangents)
        place = _place(high - low, subject)
        eye = _moved(subject.points, eye, tangents, place)
        eye[2] = front - (front - eye[2]) * float((high - low).max()) / FILL
    if config.zoom != 1:  # about where the subject stands, not about the middle
        for _ in range(_STEPS):
            eye = _moved(subject.points, eye, tangents / config.zoom, place)
    away = float(middle - eye[2])
    digits = DIGITS - floor(log10(max(float(np.ptp(subject.points, axis=0).max()), 1e-300)))
    point = np.array([*eye[:2], eye[2] + away]) @ _axes(view, config)
    x, y, z = (round(float(number), digits) for number in point)
    return replace(config, look_at=(x, y, z), distance=round(away, digits))


def _place(extent: F64, subject: _Subject) -> F64:
    """[2] where the middle of a subject that takes so much [2] of the picture is to be."""
    wide, tall = extent
    room = max(0.5 - 0.5 * wide - LEAST_ROOM, 0.0)
    aside = float(np.clip(subject.give_way, -room, room))
    is_low = float(np.clip((TALL - tall) / (TALL - LOW), 0, 1))
    is_steep = float(np.clip((subject.elevation - LEVEL) / (STEEP - LEVEL), 0, 1))
    stands = FEET + is_low * (LOW_FEET - FEET) - 0.5 * tall
    return np.array([0.5 + aside, stands + is_steep * (0.5 - stands)])


def _moved(points: F64, eye: F64, tangents: F64, place: F64) -> F64:
    """The eye [3] moved aside, so that the middle of the bounds of points nears a place [2] in the picture.

    A step of Newton's method.
    """
    seen, scale = _seen(points, eye, tangents)
    ends = np.stack([seen.argmin(axis=0), seen.argmax(axis=0)])
    middle, by_eye = (0.5 * np.take_along_axis(each, ends, axis=0).sum(axis=0) for each in (seen, scale))
    return np.asarray(eye + np.array([*((middle - place) / by_eye), 0.0]))


def _box(points: F64, eye: F64, tangents: F64) -> tuple[F64, F64]:
    """[2] and [2] the bounds of points in shares of the picture, from its upper left corner."""
    seen, _ = _seen(points, eye, tangents)
    return seen.min(axis=0), seen.max(axis=0)


def _seen(points: F64, eye: F64, tangents: F64) -> tuple[F64, F64]:
    """[n, 2] where points are in shares of the picture, and [n, 2] by which a unit aside moves them."""
    scale = 0.5 / ((points[:, 2:] - eye[2]) * tangents)
    return 0.5 + (points[:, :2] - eye[:2]) * scale, scale
