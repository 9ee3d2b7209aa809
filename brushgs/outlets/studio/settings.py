"""What the page asks for, as JSON, into values; strictly: nothing unknown, and nothing of another type.

A message names the field. Ranges are those of the options that the values become.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import degrees, isfinite
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from brushgs.options.choices import LOOKS, color_code
from brushgs.options.look_parts import USUAL_LAMP
from brushgs.options.painting import STEPS, StrokeSizeFlag
from brushgs.options.sequence import DEFAULT_FPS
from brushgs.options.table import Row, Struct, number_text, row_of
from brushgs.options.viewer import MAX_KEYS, FilmConfig, check_picture
from brushgs.values.camera import Camera

GROUNDS = ("none", "toned", "canvas", "paper")
MAX_NAME = 200  # characters of what is a name
_CAMERA = ("viewmat", "K", "width", "height", "near")

Json = Mapping[str, Any]


def _row(step: str, field: str) -> Row:
    return row_of(STEPS[step], field)


# Settings that the page has -> where the value of each goes, and its line in the table of options.
SETTINGS: Mapping[str, tuple[str, Row | None]] = {
    "look": ("look", None),
    "strokes": ("cluster.strokes", _row("cluster", "strokes")),
    "stroke_size": ("cluster.strokes", row_of(StrokeSizeFlag, "strokes")),
    "keep": ("prune.keep", _row("prune", "keep")),
    "stroke": ("draw.stroke", _row("draw", "stroke")),
    "relief": ("light.relief", _row("light", "relief")),
    "lamp": ("light.lamp", _row("light", "lamp")),
    "ground": ("ground.ground", _row("ground", "ground")),
    "palette": ("palette.file", _row("palette", "file")),
    "palette_strength": ("palette.strength", _row("palette", "strength")),
}


def schema() -> dict[str, Any]:
    """JSON schema of each setting that is an option, by its name in JSON."""
    return {camel(name): row.schema() for name, (_, row) in SETTINGS.items() if row is not None}


class Settings(Struct, frozen=True):
    """What was changed in the page; None for what is as on the command line, or in the look.

    A `stroke_size`, the typical length of strokes in pixels of the first view, is given in place of a number
    of `strokes`. The `lamp` is (azimuth, elevation), degrees. The `ground` is one of `GROUNDS` or "#rrggbb".
    A `stroke` is one of `Known.strokes`, or the id of a dropped picture, as a `palette` is, or "none".
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

    @property
    def given(self) -> dict[str, Any]:
        """Those that are set."""
        return {name: value for name, value in msgspec.structs.asdict(self).items() if value is not None}


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
    names = {camel(name): name for name in SETTINGS}
    _check_names(value, names)
    read: dict[str, Callable[[str, Any], Any]] = {
        "look": _one_of(known.looks),
        "stroke": _one_of((*known.strokes, *known.files)),
        "palette": _one_of(("none", *known.files)),
        "strokes": _count,
        "strokeSize": _number,
        "lamp": _pair,
        "ground": _ground,
    }
    of = {}
    for name, given in value.items():
        if given is None:
            continue
        row = SETTINGS[names[name]][1]
        reader: Callable[[str, Any], Any] = read.get(name, _number)
        of[names[name]] = found = reader(name, given)
        if row is not None and row.kinds[0] is float:
            row.check(found)
    settings = Settings(**of)
    if settings.strokes is not None and settings.stroke_size is not None:
        raise ValueError("strokes cannot be combined with strokeSize; send one of them")
    return settings


def overrides_of(settings: Settings, known: Known) -> dict[str, Any]:
    """The values that these settings put in place of flags, by step and field as `ConfigFlags` names them.

    A palette file of None stands for no palette, whatever the command line says.
    """
    values = {}
    for name, value in settings.given.items():
        dest, row = SETTINGS[name]
        if isinstance(value, str) and name in ("stroke", "palette") and value in known.files:
            value = known.files[value] if name == "palette" else str(known.files[value])
        elif name == "palette":
            value = None
        values[dest] = value if row is None or value is None else row.value(value)
    return values


def flags_of(settings: Settings, names: Mapping[str, str]) -> list[str]:
    """The flags that say the same on a command line; `names` are those of dropped files, by id."""
    words = []
    for name, value in settings.given.items():
        _, row = SETTINGS[name]
        if name in ("stroke", "palette"):
            value = names.get(value, value)
        if (name, value) != ("palette", "none"):
            flag = "--look" if row is None else row.flags[-1]
            text = ",".join(map(number_text, value)) if isinstance(value, tuple) else value
            text = number_text(text) if isinstance(text, float) else str(text)
            words += [flag, f"{text}px" if name == "stroke_size" else text]
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
