"""Strokes as paths on the picture plane, for vector drawings."""

from dataclasses import dataclass
from typing import Literal, NamedTuple

from brushgs.values.arrays import F64

PathKind = Literal["line", "area", "dot", "soft"]


class Path2D(NamedTuple):
    """One path.

    Attributes:
        kind: "line", an open polyline with a width; "area", closed polygons that are filled; "dot", a circle;
            "soft", an ellipse that fades from its middle as exp(-4.5 r^2).
        points: [K, 2] (x, y), pixels. Polygons of an area are separated by NaN; a dot has its center; a soft
            ellipse its center and the ends of its axes.
        width: of a line, or the diameter of a dot, pixels.
        color: RGB, 0 to 1, display-encoded.
        opacity: 0 to 1.
    """

    kind: PathKind
    points: F64
    width: float
    color: tuple[float, float, float]
    opacity: float


@dataclass(frozen=True, eq=False)
class PathGroup:
    """The paths of a coat in one region, in painting order.

    Attributes:
        coat: its name.
        region: name of the region; "" where the coat has none.
        multiplies: whether the paths multiply what lies below, see `Coat.blend`.
        paths: the first painted first.
    """

    coat: str
    region: str
    multiplies: bool
    paths: tuple[Path2D, ...]


@dataclass(frozen=True, eq=False)
class Paths:
    """A picture as paths.

    Attributes:
        width: pixels.
        height: pixels.
        ground: RGB behind the paths; None for transparent.
        groups: in painting order.
    """

    width: int
    height: int
    ground: tuple[float, float, float] | None
    groups: tuple[PathGroup, ...]
