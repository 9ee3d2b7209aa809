"""The figures of the bench, and their JSON and CSV."""

import csv
import io
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from typing import Any

from brushgs.measure.bench.timing import TimeQuartiles
from brushgs.measure.likeness import Likeness
from brushgs.stroke_count.curve import Knee

# Version of the JSON; increases when a key changes its name or meaning. Version 2 replaced `left_out` of a
# stage by `skipped`; version 3 added `best_by` to points and `knees` to a bench, one for each time.
SCHEMA = 3


@dataclass(frozen=True)
class Verified:
    """The difference of a picture from its definition, see `brushgs.measure.bench.verify`."""

    against: str
    mean: float  # difference of a channel, 0 to 1, over all pixels except those beyond a step
    beyond_step: float  # share of the pixels off by more than 1/255
    largest: float  # difference of any channel


@dataclass(frozen=True)
class Point:
    """The error and the time of one way to paint.

    Attributes:
        label: the choice in words: "2,000", "mip", "float32, 1e-04".
        series: points of one series are joined by a line.
        value: the choice as a number, if it is one.
        error: against the truth of the family.
        seconds: by timed work, the cost of the family first.
        verified: difference of the picture from its definition.
        strokes: number of painted strokes.
        unpainted: share of the plain picture's alpha; None if that picture is not the truth.
        clustering: RMSE of the same strokes drawn with the kernel of the truth; None if not measured.
        held_out: RMSE over views that the strokes were not made for; None without such views.
        best_by: the times for which the point is on the Pareto front.
    """

    label: str
    series: str
    value: float | None
    error: Likeness
    seconds: dict[str, TimeQuartiles]
    verified: Verified
    strokes: int
    unpainted: float | None = None
    clustering: float | None = None
    held_out: float | None = None
    best_by: tuple[str, ...] = ()

    @property
    def cost(self) -> TimeQuartiles:
        """The seconds that the family compares."""
        return next(iter(self.seconds.values()))


@dataclass(frozen=True)
class Family:
    """A curve: points that differ in one choice.

    Attributes:
        name: as `--families` takes it.
        title: the varied choice, in words.
        truth: the reference of pictures, in words.
        cost: the timed work, in words.
        points: in the order of the choice.
    """

    name: str
    title: str
    truth: str
    cost: str
    points: tuple[Point, ...]

    @property
    def kinds(self) -> tuple[str, ...]:
        """The names of the times, that of the family first."""
        return tuple(self.points[0].seconds) if self.points else ()

    def front(self, kind: str) -> list[Point]:
        """The Pareto front of a time, cheapest first."""
        best = (point for point in self.points if kind in point.best_by)
        return sorted(best, key=lambda point: point.seconds[kind].median)


@dataclass(frozen=True)
class Bench:
    """The figures of all families.

    Attributes:
        families: those that apply to the scene.
        knees: of the curve of strokes, by each time; empty without a curve.
        advice: one line about the knees; None without them.
        doubts: about the figures, a sentence each.
    """

    families: tuple[Family, ...]
    knees: dict[str, Knee]
    advice: str | None
    doubts: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Family:
        return next(family for family in self.families if family.name == name)

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON."""
        return {
            "families": [asdict(family) for family in self.families],
            "knees": {kind: asdict(knee) for kind, knee in self.knees.items()},
            "advice": self.advice,
            "doubts": list(self.doubts),
        }

    def as_csv(self) -> str:
        """One row per point, with the figures and names of the JSON."""
        rows = [_row(family, point) for family in self.families for point in family.points]
        names = list(dict.fromkeys(name for row in rows for name in row))
        text = io.StringIO()
        writer = csv.DictWriter(text, names, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
        return text.getvalue()


def mark_best(points: Iterable[Point]) -> tuple[Point, ...]:
    """Mark the points on the Pareto fronts of RMSE and each of the times.

    A point is on a front if no other has a smaller error in at most the same time, or the same error in less
    time. Times are equal if the quartiles of one lie between those of the other.
    """
    points = tuple(points)
    kinds = points[0].seconds if points else ()
    return tuple(
        replace(
            point,
            best_by=tuple(kind for kind in kinds if not any(_beats(other, point, kind) for other in points)),
        )
        for point in points
    )


def _beats(other: Point, point: Point, kind: str) -> bool:
    theirs, own = other.seconds[kind], point.seconds[kind]
    if other.error.rmse != point.error.rmse:
        return other.error.rmse < point.error.rmse and (theirs.median <= own.median or theirs.is_same_as(own))
    return theirs.median < own.median and not theirs.is_same_as(own)


def _row(family: Family, point: Point) -> dict[str, Any]:
    row: dict[str, Any] = {"family": family.name, "series": point.series, "label": point.label}
    row |= {"value": point.value, "strokes": point.strokes}
    row |= asdict(point.error)
    row |= {name: getattr(point, name) for name in ("unpainted", "clustering", "held_out")}
    for name, quartiles in point.seconds.items():
        row |= {f"{name}_{key}": value for key, value in asdict(quartiles).items()}
        row[f"{name}_is_best"] = int(name in point.best_by)
    row |= {f"verified_{key}": value for key, value in asdict(point.verified).items()}
    return {name: "" if value is None else value for name, value in row.items()}
