"""The figures of the bench, and their JSON and CSV."""

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from brushgs.measure.bench.timing import TimeQuartiles
from brushgs.measure.likeness import Likeness
from brushgs.stroke_count.curve import Knee

# Version of the JSON; increases when a key changes its name or meaning. Since 2 a stage has `skipped` in
# place of `left_out`.
SCHEMA = 2


@dataclass(frozen=True)
class Verified:
    """How far a picture is from its definition, see `brushgs.measure.bench.verify`."""

    against: str
    mean: float  # difference of a channel, 0 to 1, over all pixels except those beyond a step
    beyond_step: float  # share of the pixels off by more than 1/255
    largest: float  # difference of any channel


@dataclass(frozen=True)
class Point:
    """One way to paint: its error and its time.

    Attributes:
        label: the choice in words: "2,000", "mip", "float32, 1e-04".
        series: points of one series are joined by a line.
        value: the choice as a number, if it is one.
        error: against the truth of the family.
        seconds: by what was timed, the cost of the family first.
        verified: how well the picture agreed with its definition.
        strokes: how many were painted.
        unpainted: share of the plain picture's alpha; None if that picture is not the truth.
        is_best: whether the point is on the Pareto front.
    """

    label: str
    series: str
    value: float | None
    error: Likeness
    seconds: dict[str, TimeQuartiles]
    verified: Verified
    strokes: int
    unpainted: float | None = None
    is_best: bool = False

    @property
    def cost(self) -> TimeQuartiles:
        """The seconds that the family compares."""
        return next(iter(self.seconds.values()))


@dataclass(frozen=True)
class Family:
    """A curve: points that differ in one choice.

    Attributes:
        name: as `--families` takes it.
        title: what varies, in words.
        truth: what pictures are compared with, in words.
        cost: what is timed, in words.
        points: in the order of the choice.
    """

    name: str
    title: str
    truth: str
    cost: str
    points: tuple[Point, ...]

    @property
    def best(self) -> list[Point]:
        """The Pareto front, cheapest first."""
        return sorted((point for point in self.points if point.is_best), key=lambda p: p.cost.median)


@dataclass(frozen=True)
class Bench:
    """The figures of all families.

    Attributes:
        families: those that apply to the scene.
        knee: of the curve of strokes, by the seconds of a frame; None without a curve.
        advice: one line about the knee; None without one.
    """

    families: tuple[Family, ...]
    knee: Knee | None
    advice: str | None

    def __getitem__(self, name: str) -> Family:
        return next(family for family in self.families if family.name == name)

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON."""
        return {
            "families": [asdict(family) for family in self.families],
            "knee": None if self.knee is None else asdict(self.knee),
            "advice": self.advice,
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
    """Mark the points on the Pareto front of median seconds and RMSE.

    A point is on it if no other is better in one of the two and at least as good in the other.
    """
    points = tuple(points)
    pairs = [(point.cost.median, point.error.rmse) for point in points]
    return tuple(
        replace(point, is_best=not any(_beats(other, pair) for other in pairs))
        for point, pair in zip(points, pairs, strict=True)
    )


def _beats(other: Sequence[float], pair: Sequence[float]) -> bool:
    return other != pair and all(theirs <= own for theirs, own in zip(other, pair, strict=True))


def _row(family: Family, point: Point) -> dict[str, Any]:
    row: dict[str, Any] = {"family": family.name, "series": point.series, "label": point.label}
    row |= {"value": point.value, "strokes": point.strokes, "is_best": int(point.is_best)}
    row |= asdict(point.error) | {"unpainted": point.unpainted}
    for name, quartiles in point.seconds.items():
        row |= {f"{name}_{key}": value for key, value in asdict(quartiles).items()}
    row |= {f"verified_{key}": value for key, value in asdict(point.verified).items()}
    return {name: "" if value is None else value for name, value in row.items()}
