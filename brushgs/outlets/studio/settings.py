"""Parse requests of the page (JSON) strictly: unknown fields and other types are refused.

Messages name the field. Ranges are those of the options.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import degrees
from pathlib import Path
from typing import Annotated, Any, TypeVar

import msgspec
import numpy as np

from brushgs.formats.schema import fault
from brushgs.options.choices import LOOKS, color_code
from brushgs.options.look_parts import USUAL_LAMP
from brushgs.options.painting import STEPS, StrokeSizeFlag
from brushgs.options.sequence import DEFAULT_FPS
from brushgs.options.table import LARGEST, Row, Struct, number_text, row_of
from brushgs.options.viewer import MAX_KEYS, FilmConfig, FilmKind, check_picture
from brushgs.values.camera import Camera

GROUNDS = ("none", "toned", "canvas", "paper")

Json = Mapping[str, Any]
T = TypeVar("T")
Number = Annotated[float, msgspec.Meta(ge=-LARGEST, le=LARGEST, description="a number")]
Seconds = Annotated[float, msgspec.Meta(ge=0, le=LARGEST, description="a number of 0 or more")]
Count = Annotated[int, msgspec.Meta(ge=1, lt=2**31, description="a whole number of 1 or more")]


def _row(step: str, field: str) -> Row:
    return row_of(STEPS[step], field)


# Settings of the page -> target of the value, and row of the option table.
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
    "focus": ("strokes.focus", _row("strokes", "focus")),
    "part": ("painted.expression", _row("painted", "expression")),
    "up": ("view.up", _row("view", "up")),
    "azimuth": ("view.azimuth", _row("view", "azimuth")),
}


def schema() -> dict[str, Any]:
    """JSON schema of each setting that is an option, by its name in JSON."""
    return {camel(name): row.schema() for name, (_, row) in SETTINGS.items() if row is not None}


class Settings(Struct, frozen=True, forbid_unknown_fields=True, rename="camel"):
    """What was changed in the page; None for what is as on the command line, or in the look.

    `stroke_size`, the typical length of strokes in pixels of the first view, replaces `strokes`. `lamp` is
    (azimuth, elevation), degrees. `ground` is one of `GROUNDS` or "#rrggbb". `stroke` is one of
    `Known.strokes` or the id of a dropped picture; `palette` is such an id or "none". `focus` is a ball of
    denser strokes: center and radius, world units. `part` is the part that is painted, as text of `--where`.
    `up` is an axis; `azimuth` that of the first view, degrees.
    """

    look: str | None = None
    strokes: Count | None = None
    stroke_size: Number | None = None
    keep: Number | None = None
    stroke: str | None = None
    relief: Number | None = None
    lamp: tuple[Number, Number] | None = None
    ground: str | None = None
    palette: str | None = None
    palette_strength: Number | None = None
    focus: tuple[Number, Number, Number, Number] | None = None
    part: str | None = None
    up: tuple[Number, Number, Number] | None = None
    azimuth: Number | None = None

    @property
    def of_any_scene(self) -> "Settings":
        """Without places and axes, which are those of one scene."""
        return msgspec.structs.replace(self, focus=None, part=None, up=None, azimuth=None)

    @property
    def given(self) -> dict[str, Any]:
        """The changed values."""
        return {name: value for name, value in msgspec.structs.asdict(self).items() if value is not None}


@dataclass(frozen=True)
class Known:
    """Names allowed in settings.

    Attributes:
        looks: built-in looks, and that of the command line.
        strokes: built-in strokes, and that of the command line.
        files: paths of dropped files by id.
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
    """Parse settings.

    Raises:
        ValueError: if a field or name is unknown, or a value has another type.
    """
    settings = request_of(value, Settings)
    offered = {
        "look": known.looks,
        "stroke": (*known.strokes, *known.files),
        "palette": ("none", *known.files),
    }
    for name, given in settings.given.items():
        if given not in offered.get(name, (given,)):
            raise ValueError(f"{name} must be one that the page offers, got {given[:60]!r}; reload the page")
        row = SETTINGS[name][1]
        if row is not None and row.kinds[0] is float:
            row.check(given)
    ground = settings.ground
    if ground is not None and not (ground in GROUNDS or (ground.startswith("#") and color_code(ground))):
        raise ValueError(f"ground must be {', '.join(GROUNDS)} or #rrggbb, got {ground[:60]!r}")
    if settings.strokes is not None and settings.stroke_size is not None:
        raise ValueError("strokes cannot be combined with strokeSize; send one of them")
    return settings


def overrides_of(settings: Settings, known: Known) -> dict[str, Any]:
    """The overrides of flags, by step and field.

    A palette file of None removes the palette of the command line; a side of None, that of `--from`.
    """
    values: dict[str, Any] = {}
    for name, value in settings.given.items():
        dest, row = SETTINGS[name]
        if isinstance(value, str) and name in ("stroke", "palette") and value in known.files:
            value = known.files[value] if name == "palette" else str(known.files[value])
        elif name == "palette":
            value = None
        elif name in ("focus", "up"):
            value = ",".join(map(number_text, value))
        elif name == "azimuth":
            values["view.side"] = None
        values[dest] = value if row is None or value is None else row.value(value)
    return values


def flags_of(settings: Settings, names: Mapping[str, str]) -> list[str]:
    """The equivalent flags; `names` are original names of dropped files by id."""
    words = []
    for name, value in settings.given.items():
        _, row = SETTINGS[name]
        if name in ("stroke", "palette"):
            value = names.get(value, value)
        if (name, value) != ("palette", "none"):
            flag = "--look" if row is None else row.flags[-1]
            text = ",".join(map(number_text, value)) if isinstance(value, tuple) else value
            text = number_text(text) if isinstance(text, float) else str(text)
            text = f"{text}px" if name == "stroke_size" else text
            # A value that begins with a minus would be taken for a flag.
            words += [f"{flag}={text}"] if text.startswith("-") else [flag, text]
    return words


class CameraRequest(Struct, frozen=True, forbid_unknown_fields=True):
    """A camera of the page; see `Camera`, whose matrices are in rows."""

    viewmat: Annotated[list[Number], msgspec.Meta(min_length=16, max_length=16)]
    K: Annotated[list[Number], msgspec.Meta(min_length=9, max_length=9)]
    width: Count
    height: Count
    near: Number

    def camera(self, place: str) -> Camera:
        """The camera. Raises ValueError, with its place in the request."""
        try:
            check_picture(self.width, self.height)
            viewmat, K = np.array(self.viewmat).reshape(4, 4), np.array(self.K).reshape(3, 3)
            return Camera(viewmat, K, self.width, self.height, self.near)
        except ValueError as error:
            raise ValueError(f"{place}: {str(error).removeprefix('Camera: ')}") from None


class ShotRequest(Struct, frozen=True, forbid_unknown_fields=True):
    """A picture that is asked for."""

    camera: CameraRequest
    width: Count
    height: Count
    seconds: Seconds = 0.0


class FilmRequest(Struct, frozen=True, forbid_unknown_fields=True):
    """A video that is asked for; a turn has one camera and a center, a clip one camera."""

    kind: FilmKind
    cameras: Annotated[list[CameraRequest], msgspec.Meta(min_length=1, max_length=MAX_KEYS)]
    seconds: Number
    width: Count
    height: Count
    fps: Number = DEFAULT_FPS
    loop: bool = False
    center: tuple[Number, Number, Number] | None = None


class MomentRequest(Struct, frozen=True, forbid_unknown_fields=True):
    """A moment of a moving scene that is shown."""

    seconds: Seconds


class PartRequest(Struct, frozen=True, forbid_unknown_fields=True):
    """A part of the scene that was typed."""

    where: str


@dataclass(frozen=True)
class Shot:
    """A requested picture: the camera in its size, and seconds from the start of a moving scene."""

    camera: Camera
    seconds: float = 0.0


@dataclass(frozen=True)
class Film:
    """A requested video.

    Attributes:
        config: its kind, duration and size.
        cameras: first view of a turn, key views of a path, or the view of a clip.
        center: [3] center of a turn, world units; else None.
    """

    config: FilmConfig
    cameras: list[Camera]
    center: tuple[float, ...] | None = None


def read_moment(value: Json) -> float:
    """Seconds of a `MomentRequest`. Raises ValueError."""
    return request_of(value, MomentRequest).seconds


def read_shot(value: Json) -> Shot:
    """A picture of a `ShotRequest`. Raises ValueError."""
    asked = request_of(value, ShotRequest)
    check_picture(asked.width, asked.height)
    return Shot(asked.camera.camera("camera").resized(asked.width, asked.height), asked.seconds)


def read_film(value: Json) -> Film:
    """A video of a `FilmRequest`. Raises ValueError."""
    asked = request_of(value, FilmRequest)
    config = FilmConfig(asked.kind, asked.seconds, asked.width, asked.height, asked.fps, asked.loop)
    if asked.kind == "turn" and (len(asked.cameras) != 1 or asked.center is None):
        raise ValueError("a turn must have one camera and a center")
    if asked.kind != "turn" and asked.center is not None:
        raise ValueError(f"center belongs to a turn; a {asked.kind} has none")
    if asked.kind == "clip" and len(asked.cameras) != 1:
        raise ValueError("a clip must have one camera, which rests")
    cameras = [view.camera(f"cameras[{index}]") for index, view in enumerate(asked.cameras)]
    return Film(config, [camera.resized(config.width, config.height) for camera in cameras], asked.center)


def read_part(value: Json) -> str:
    """What was typed for a part of the scene. Raises ValueError."""
    return request_of(value, PartRequest).where


def shown_lamp(lamp: tuple[float, float] | None) -> list[float]:
    """A lamp for the page, degrees; the usual one for None."""
    return [round(degrees(angle), 3) for angle in lamp or USUAL_LAMP]


def camel(name: str) -> str:
    """snake_case to camelCase."""
    first, *rest = name.split("_")
    return first + "".join(word.capitalize() for word in rest)


def request_of(value: Json, kind: type[T]) -> T:
    """A request as a struct. Raises ValueError, with a sentence that names the field."""
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        raise ValueError(fault(error, value, kind)) from None


def _no_constant(text: str) -> None:
    raise ValueError(f"{text} is no number")
