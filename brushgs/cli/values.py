"""What the text of a flag means: numbers, counts, sizes in pixels, stroke targets, parts of a scene.

Each function takes the text of one flag and raises `ArgumentTypeError`, whose message argparse prints after
the name of the flag. Classes of `brushgs.options` are imported where they are made: `--help` needs none.
"""

import re
from argparse import ArgumentTypeError
from collections.abc import Callable
from math import isfinite, radians
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar, get_args

from brushgs.options.choices import Target, size_rule
from brushgs.options.stroke_number import parse_share, parse_strokes

if TYPE_CHECKING:
    from brushgs.options.direction import Direction
    from brushgs.options.focus import Focus
    from brushgs.options.moment import Moment
    from brushgs.options.painting import ErrorBudget, StrokeSize
    from brushgs.options.styling import StyleShare
    from brushgs.options.where import Where

T = TypeVar("T")


def number(text: str) -> float:
    """A finite number."""
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not isfinite(value):
        raise ArgumentTypeError(f"must be a number, got {text!r}")
    return value


def share(text: str) -> float:
    """A share, as a number or in percent: 0.7 or 70%."""
    return _checked(parse_share, text)


def degrees(text: str) -> float:
    """An angle given in degrees, in radians."""
    return radians(number(text))


def numbers(text: str, count: int) -> tuple[float, ...]:
    """So many finite numbers, separated by commas."""
    words = text.split(",")
    if len(words) != count:
        raise ArgumentTypeError(f"must be {count} numbers separated by commas, got {text!r}")
    return tuple(number(word) for word in words)


def pair(text: str) -> tuple[float, ...]:
    """Two finite numbers."""
    return numbers(text, 2)


def look_at(text: str) -> str | tuple[float, ...]:
    """A value of `ViewConfig.look_at`."""
    if text in get_args(Target):
        return text
    try:
        return numbers(text, 3)
    except ArgumentTypeError:
        names = ", ".join(get_args(Target))
        raise ArgumentTypeError(f"must be {names} or three numbers such as 0,1.5,-2, got {text!r}") from None


def count_from(least: int) -> Callable[[str], int]:
    """The parser of a whole number of `least` or more."""

    def count(text: str) -> int:
        if not re.fullmatch(r"\+?[0-9]{1,18}", text) or int(text) < least:
            raise ArgumentTypeError(f"must be a whole number of {least} or more, got {text!r}")
        return int(text)

    return count


def counts(text: str) -> tuple[int, ...]:
    """Whole numbers of 1 or more, separated by commas."""
    return tuple(count_from(1)(word) for word in text.split(","))


def words(text: str) -> tuple[str, ...]:
    """Words, separated by commas."""
    return tuple(word.strip() for word in text.split(","))


def picture_size(text: str) -> tuple[int, int]:
    """(width, height) in pixels of a text such as "1280x720"."""
    match = re.fullmatch(r"([0-9]{1,18})[xX]([0-9]{1,18})", text)
    if match is None:
        raise ArgumentTypeError(f"must be WIDTHxHEIGHT in pixels such as 1280x720, got {text!r}")
    size = int(match[1]), int(match[2])
    if broken := size_rule(*size):
        raise ArgumentTypeError(broken)
    return size


def chosen_size(text: str) -> tuple[int, int] | str:
    """(width, height) in pixels as `picture_size`, or "auto" for one that is chosen."""
    if text == "auto":
        return text
    try:
        return picture_size(text)
    except ArgumentTypeError as error:
        raise ArgumentTypeError(f"{error}; or auto" if "x" not in text.lower() else str(error)) from None


def strokes(text: str) -> "int | float | str | ErrorBudget | None":
    """A value of `ClusterConfig.strokes`, see `parse_strokes`."""
    return _checked(parse_strokes, text)


def stroke_size(text: str) -> "StrokeSize":
    """A typical length of strokes in pixels; the unit may be omitted."""
    from brushgs.options.painting import StrokeSize

    match = re.fullmatch(r"([0-9]+\.?[0-9]*|\.[0-9]+) ?(px)?", text, re.IGNORECASE)
    if match is None:
        raise ArgumentTypeError(f"must be a length above 0 in pixels such as 24px, got {text!r}")
    return _checked(StrokeSize, float(match[1]))


def memory(text: str) -> int:
    """Bytes, see `parse_memory`."""
    from brushgs.options.memory_size import parse_memory

    return _checked(parse_memory, text)


def where(text: str) -> "Where":
    """A part of a scene, see `Where.parse`."""
    from brushgs.options.where import Where

    return _checked(Where.parse, text)


def camera_file(text: str) -> Path | None:
    """A file of cameras; None for "none". A file of that name is "./none"."""
    return None if text == "none" else Path(text)


def on_off(text: str) -> bool:
    """Whether a switch is on."""
    if text not in ("on", "off"):
        raise ArgumentTypeError(f"must be on or off, got {text!r}")
    return text == "on"


def backdrop(text: str) -> bool | int | str:
    """A kind of backdrop, whether there is one, or its number of loose strokes; 0 is off."""
    if text in ("on", "off"):
        return text == "on"
    if text in ("stage", "loose"):
        return text
    try:
        return count_from(0)(text) or False
    except ArgumentTypeError:
        raise ArgumentTypeError(f"must be stage, loose, on, off or a whole number, got {text!r}") from None


def lamp(text: str) -> tuple[float, ...]:
    """An azimuth and an elevation given in degrees, in radians."""
    return tuple(map(radians, pair(text)))


def sun(text: str) -> tuple[float, ...]:
    """One azimuth with its elevation, or two with .. between them, given in degrees, in radians."""
    ends = text.split("..")
    if len(ends) > 2:
        raise ArgumentTypeError(f"must be AZ,EL or AZ,EL..AZ,EL in degrees, got {text!r}")
    return tuple(angle for end in ends for angle in lamp(end))


def scene_time(text: str) -> "Moment":
    """The moment of a scene, or all of them, see `Moment.parse`."""
    from brushgs.options.moment import Moment

    return _checked(Moment.parse, text)


def clip_time(text: str) -> "Moment":
    """A moment of a clip, see `Moment.parse`."""
    found = scene_time(text)
    if found.is_all:
        raise ArgumentTypeError("must be one moment, seconds such as 0.4 or a share such as 40%, got all")
    return found


def focus(text: str) -> "Focus | None":
    """Where more strokes go, see `Focus.of`; None for "off"."""
    from brushgs.options.focus import Focus

    return _checked(Focus.of, text)


def direction(text: str) -> "Direction":
    """Which way strokes run, see `Direction.of`."""
    from brushgs.options.direction import Direction

    return _checked(Direction.of, text)


def styles(text: str) -> "tuple[StyleShare, ...]":
    """Styles with their shares, see `StyleConfig.parse`."""
    from brushgs.options.styling import StyleConfig

    return _checked(StyleConfig.parse, text).styles


def adjustments(text: str) -> dict[str, float]:
    """Changes of colour by name, see `AdjustConfig.parse`."""
    from brushgs.options.styling import AdjustConfig

    try:
        return AdjustConfig.parse(text)
    except ValueError as error:  # of several numbers it names the one
        raise ArgumentTypeError(str(error).removeprefix("adjust ")) from None


def swap(text: str) -> str:
    """Two colours, see `AdjustConfig`."""
    from brushgs.options.styling import check_swap

    return _checked(check_swap, text)


def _checked(make: Callable[..., T], *values: object) -> T:
    """Make an option that checks itself; its error loses its first word, since argparse names the flag."""
    try:
        return make(*values)
    except ValueError as error:
        raise ArgumentTypeError(re.sub(r"^[\w-]+ (?=must )", "", str(error))) from None
