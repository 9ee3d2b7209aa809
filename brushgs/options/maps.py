"""Control maps as text, such as `size=mask.png:0.5..2`: a property, its source, and its range of factors."""

import re
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

from brushgs.options.hand import MAX_HOLD
from brushgs.options.table import Struct, hint_for, shown
from brushgs.options.where import Where
from brushgs.options.where_terms import TERMS

FORM = "PROPERTY=SOURCE[:LOW..HIGH], such as size=mask.png:0.5..2"
COLUMN = "column"  # prefix of a source that is a column
_SPAN = re.compile(r"(.*):\s*([-+.\de]+?)\s*\.\.\s*([-+.\de]+)\s*", re.IGNORECASE | re.DOTALL)
_HEIGHT = re.compile(r"\bheight\s*$", re.IGNORECASE)
_SPOILT = re.compile(r":[^:/\\]*\.\.[^:/\\]*$")  # a range whose factors are no numbers
_COMBINED = re.compile(r"\s*(\(|not[\s(])|\s(and|or)[\s(]", re.IGNORECASE)


class Span(NamedTuple):
    """Default factors of a property at black (`low`) and white (`high`), and their limits."""

    low: float
    high: float
    least: float
    most: float


# Properties of maps and rules. Opacity can only be lowered, since strokes are solid.
PROPERTIES: Mapping[str, Span] = {
    "size": Span(0.5, 2.0, 0.2, 5.0),
    "density": Span(0.5, 2.0, 0.1, 10.0),
    "opacity": Span(0.0, 1.0, 0.0, 1.0),
    "chroma": Span(0.0, 2.0, 0.0, 3.0),
    "relief": Span(0.0, 2.0, 0.0, 4.0),  # height of the paint
    "edge": Span(0.0, 1.0, 0.0, 1.0),  # how far outlines are lost
    "hold": Span(1.0, 2.0, 1.0, MAX_HOLD),  # frames of a film, rounded
}


class Map(Struct, frozen=True):
    """A property of strokes that follows a picture of the first view, or membership in a part of the scene.

    Attributes:
        name: the property, one of `PROPERTIES`.
        source: a picture, whose lightness is the value; a part, inside which the value is 1; or the name of a
            column of the PLY file, whose low numbers give 0 and high numbers 1.
        low: factor at value 0: black, or outside the part.
        high: factor at value 1: white, or inside the part. It may be below `low`.

    Raises:
        ValueError: if the property is unknown, a factor is out of its limits, or the part has a term `mask:`.
    """

    name: str
    source: Path | Where | str
    low: float
    high: float

    def __post_init__(self) -> None:
        if self.name not in PROPERTIES:
            known = ", ".join(PROPERTIES)
            raise ValueError(
                f"map must change {known}, got {shown(self.name)}{hint_for(self.name, tuple(PROPERTIES))}"
            )
        _, _, least, most = PROPERTIES[self.name]
        for factor in (self.low, self.high):
            if not (isfinite(factor) and least <= factor <= most):
                raise ValueError(
                    f"map {self.name} must have factors of {least:g} to {most:g}, got {factor:g}"
                )
        if isinstance(self.source, Where) and self.source.needs_cameras:
            raise ValueError(
                f"map {self.name} must not have mask:, which needs cameras of its own; name a picture of the "
                "first view without mask:, or write --rules"
            )

    @classmethod
    def parse(cls, text: str) -> "Map":
        """Parse a text, see `FORM`.

        Raises:
            ValueError: if it is invalid.
        """
        name, equals, rest = (part.strip() for part in text.partition("="))
        if not equals or not rest:
            raise ValueError(f"map must be {FORM}, got {shown(text)}")
        default = PROPERTIES.get(name, Span(1, 1, 1, 1))
        source, low, high = rest, default.low, default.high
        # `height:0.2..1` is a part without factors; `height:0.2..1:0.5..2` has both.
        if (match := _SPAN.fullmatch(rest)) and not _HEIGHT.search(match[1]):
            try:
                source, low, high = match[1].strip(), float(match[2]), float(match[3])
            except ValueError:
                raise ValueError(f"map must be {FORM}, got {shown(text)}") from None
        term = source.partition(":")[0].strip().lower()
        is_part = term in TERMS or _COMBINED.search(source) is not None
        if not is_part and _SPOILT.search(source):
            raise ValueError(f"map must be {FORM}, got {shown(text)}")
        if term == COLUMN:
            return cls(name, source.partition(":")[2].strip(), low, high)
        return cls(name, Where.parse(source) if is_part else Path(source), low, high)

    def __str__(self) -> str:
        source = f"{COLUMN}:{self.source}" if isinstance(self.source, str) else self.source
        return f"{self.name}={source}:{self.low:g}..{self.high:g}"


def read_maps(text: str) -> tuple[Map, ...]:
    """Parse the text of one map, as a tuple of length 1. Raises as `Map.parse`."""
    return (Map.parse(text),)


def make_maps(given: Any) -> tuple[Map, ...]:
    """Maps from a list of texts or maps.

    Raises:
        ValueError: if it is not a list of these, or a text is invalid.
    """
    if isinstance(given, Map):
        return (given,)
    if not isinstance(given, list | tuple) or not all(isinstance(one, str | Map) for one in given):
        raise ValueError(f"must be a list of texts {FORM}, got {shown(given)}")
    return tuple(one if isinstance(one, Map) else Map.parse(one) for one in given)
