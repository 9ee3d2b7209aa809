"""What the page asks for, as JSON, into values; strictly: nothing unknown, and nothing of another type.

A message names the field. Ranges are those of the options that the values become.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from math import degrees, isfinite, radians
from pathlib import Path
from typing import Any

import numpy as np

from brushgs.options.choices import LOOKS, color_code
from brushgs.options.look_parts import USUAL_LAMP
from brushgs.options.painting import StrokeSize
from brushgs.options.sequence import DEFAULT_FPS
from brushgs.options.viewer import MAX_KEYS, FilmConfig, check_picture
from brushgs.values.camera import Camera

GROUNDS = ("none", "toned", "canvas", "paper")
MAX_NAME = 200  # characters of what is a name
_CAMERA = ("viewmat", "K", "width", "height", "near")

Json = Mapping[str, Any]


@dataclass(frozen=True)
class Settings:
    """What was changed in the page; None for what is as on the command line, or in the look.

    Attributes:
        look: one of `Known.looks`.
        strokes: a number of them.
        stroke_size: in place of a number, their typical length in pixels of the first view.
        keep: share of the Gaussians.
        stroke: one of `Known.strokes`, or the id of a dropped picture.
        relief: 0 to 1.
        lamp: (azimuth, elevation), degrees.
        ground: "none", "toned", "canvas", "paper" or "#rrggbb".
        palette: the id of a dropped picture, or "none".
        palette_strength: 0 to 1.
    """

    look: str | None = None
    strokes: int | None = None
    stroke_size: float | None = None
    keep: float | None = None
    stroke: str | None = None
    relief: float | None = None
    lamp: tuple[float, float] | None = None
    ground: str | None = None
    palette: str | None = None
    palette_strength: float | None = None


@dataclass(frozen=True)
class Known:
    """The names that settings may have.

    Attributes:
        looks: those that come with the program, and the one of the command line.
        strokes: built-in strokes, and the one of the command line.
        files: what was dropped, by id: where it lies.
    """

    looks: Sequence[str] = LOOKS
    strokes: Sequence[str] = ()
    files: Mapping[str, Path] = field(default_factory=dict)


def read_json(text: bytes) -> Json:
    """A JSON object. Raises ValueError, with a sentence."""
    try:
        value = json.loads(text, parse_constant=_no_constant)
    except RecursionError:
        raise ValueError("the request is nested too deeply") from None
    except ValueError as error:
        raise ValueError(f"the request is not JSON: {error}") from None
    if not isinstance(value, dict):
        raise ValueError("the request must be a JSON object")
    return value


def read_settings(value: Json, known: Known) -> Settings:
    """The settings that the page sent.

    Raises:
        ValueError: if there is an unknown field, or a value of another type, or an unknown name.
    """
    names = {camel(one.name): one.name for one in fields(Settings)}
    _check_names(value, names)
    read: dict[str, Callable[[str, Any], Any]] = {
        "look": _one_of(known.looks),
        "stroke": _one_of((*known.strokes, *known.files)),
        "palette": _one_of(("none", *known.files)),
        "strokes": _count,
        "lamp": _pair,
        "ground": _ground,
    }
    given = {name: names[name] for name in value if value[name] is not None}
    of: dict[str, Any] = {}
    for name, known_field in given.items():
        reader: Callable[[str, Any], Any] = read.get(name, _number)
        of[known_field] = reader(name, value[name])
    settings = Settings(**of)
    if settings.strokes is not None and settings.stroke_size is not None:
        raise ValueError("strokes cannot be combined with strokeSize; send one of them")
    return settings


def overrides_of(settings: Settings, known: Known) -> dict[str, Any]:
    """The values that these settings put in place of flags, by step and field as `ConfigFlags` names them.

    A palette file of None stands for no palette, whatever the command line says.
    """
    values: dict[str, Any] = {
        "look": settings.look,
        "cluster.strokes": settings.strokes,
        "prune.keep": settings.keep,
        "draw.stroke": settings.stroke,
        "light.relief": settings.relief,
        "light.lamp": None if settings.lamp is None else tuple(map(radians, settings.lamp)),
        "ground.ground": settings.ground,
        "palette.strength": settings.palette_strength,
    }
    if settings.stroke_size is not None:
        values["cluster.strokes"] = StrokeSize(settings.stroke_size)
    if settings.stroke is not None and settings.stroke in known.files:
        values["draw.stroke"] = str(known.files[settings.stroke])
    if settings.palette is not None and settings.palette in known.files:
        values["palette.file"] = known.files[settings.palette]
    given = {name: value for name, value in values.items() if value is not None}
    return given | ({"palette.file": None} if settings.palette == "none" else {})


def flags_of(settings: Settings, names: Mapping[str, str]) -> list[str]:
    """The flags that say the same on a command line; `names` are those of dropped files, by id."""
    words = []
    values = {
        "--look": settings.look,
        "--strokes": settings.strokes,
        "--stroke-size": None if settings.stroke_size is None else f"{settings.stroke_size:g}px",
        "--keep": settings.keep,
        "--stroke": None if settings.stroke is None else names.get(settings.stroke, settings.stroke),
        "--relief": settings.relief,
        "--lamp": None if settings.lamp is None else ",".join(f"{angle:g}" for angle in settings.lamp),
        "--ground": settings.ground,
        "--palette": None if settings.palette in (None, "none") else names.get(settings.palette or ""),
        "--palette-strength": settings.palette_strength,
    }
    for flag, value in values.items():
        if value is not None:
            words += [flag, f"{value:g}" if isinstance(value, float) else str(value)]
    return words


@dataclass(frozen=True)
class Shot:
    """A picture that is asked for: the camera in the size of the picture."""

    camera: Camera


@dataclass(frozen=True)
class Film:
    """A video that is asked for.

    Attributes:
        config: its kind, duration and size.
        cameras: the view that a turn begins with, or the key views of a path.
        center: [3] what a turn goes around, world units; None for a path.
    """

    config: FilmConfig
    cameras: list[Camera]
    center: tuple[float, ...] | None = None


def read_shot(value: Json) -> Shot:
    """A picture, {camera, width, height}. Raises ValueError."""
    _check_names(value, ("camera", "width", "height"), needs_all=True)
    width, height = _count("width", value["width"]), _count("height", value["height"])
    check_picture(width, height)
    return Shot(_camera("camera", value["camera"]).resized(width, height))


def read_film(value: Json) -> Film:
    """A video, {kind, cameras, seconds, width, height} and maybe {fps, loop, center}. Raises ValueError."""
    needed = ("kind", "cameras", "seconds", "width", "height")
    _check_names(value, (*needed, "fps", "loop", "center"))
    _check_names({name: None for name in value if name in needed}, needed, needs_all=True)
    if not isinstance(value.get("loop", False), bool):
        raise ValueError("loop must be true or false")
    config = FilmConfig(
        value["kind"],
        _number("seconds", value["seconds"]),
        _count("width", value["width"]),
        _count("height", value["height"]),
        _number("fps", value.get("fps", DEFAULT_FPS)),
        value.get("loop", False),
    )
    views = value["cameras"]
    if not isinstance(views, list) or not 1 <= len(views) <= MAX_KEYS:
        raise ValueError(f"cameras must be a list of 1 to {MAX_KEYS} cameras")
    center = None
    if config.kind == "turn":
        if len(views) != 1 or "center" not in value:
            raise ValueError("a turn must have one camera and a center")
        center = tuple(_numbers("center", value["center"], 3))
    elif "center" in value:
        raise ValueError("center belongs to a turn; a path has none")
    cameras = [_camera(f"cameras[{index}]", view) for index, view in enumerate(views)]
    return Film(config, [camera.resized(config.width, config.height) for camera in cameras], center)


def read_part(value: Json) -> Any:
    """What was typed for a part of the scene, {where}. Raises ValueError."""
    _check_names(value, ("where",), needs_all=True)
    return value["where"]


def shown_lamp(lamp: tuple[float, float] | None) -> list[float]:
    """A lamp for the page, degrees; the usual one for None."""
    return [round(degrees(angle), 3) for angle in lamp or USUAL_LAMP]


def camel(name: str) -> str:
    """A name of Python as one of JSON."""
    first, *rest = name.split("_")
    return first + "".join(word.capitalize() for word in rest)


def _check_names(value: Any, known: Sequence[str] | Mapping[str, Any], *, needs_all: bool = False) -> None:
    if not isinstance(value, dict):
        raise ValueError("the request must be a JSON object")
    for name in value:
        if name not in known:
            raise ValueError(f"there is no field {str(name)[:60]!r}, only {', '.join(known)}")
    if needs_all and (missing := [name for name in known if name not in value]):
        raise ValueError(f"there is no {missing[0]}, which the request must have")


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or abs(value) > 1e300:
        raise ValueError(f"{name} must be a number")
    if not isfinite(value):
        raise ValueError(f"{name} must be finite")
    return float(value)


def _count(name: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value < 2**31:
        raise ValueError(f"{name} must be a whole number of 1 or more")
    return value


def _numbers(name: str, value: Any, count: int) -> list[float]:
    if not isinstance(value, list) or len(value) != count:
        raise ValueError(f"{name} must be a list of {count} numbers")
    return [_number(name, number) for number in value]


def _pair(name: str, value: Any) -> tuple[float, float]:
    first, second = _numbers(name, value, 2)
    return first, second


def _one_of(known: Sequence[str]) -> Callable[[str, Any], str]:
    def read(name: str, value: Any) -> str:
        if not isinstance(value, str) or value not in known:
            shown = str(value)[:60]
            raise ValueError(f"{name} must be one that the page offers, got {shown!r}; reload the page")
        return value

    return read


def _ground(name: str, value: Any) -> str:
    is_known = isinstance(value, str) and len(value) < MAX_NAME
    if not is_known or not (value in GROUNDS or (value.startswith("#") and color_code(value))):
        raise ValueError(f"{name} must be {', '.join(GROUNDS)} or #rrggbb")
    return str(value)


def _camera(name: str, value: Any) -> Camera:
    try:
        _check_names(value, _CAMERA, needs_all=True)
        viewmat = np.array(_numbers("viewmat", value["viewmat"], 16)).reshape(4, 4)
        K = np.array(_numbers("K", value["K"], 9)).reshape(3, 3)
        width, height = _count("width", value["width"]), _count("height", value["height"])
        check_picture(width, height)
        return Camera(viewmat, K, width, height, _number("near", value["near"]))
    except ValueError as error:
        raise ValueError(f"{name}: {str(error).removeprefix('Camera: ')}") from None


def _no_constant(text: str) -> None:
    raise ValueError(f"{text} is no number")
