"""The curves as a plot: a panel for each family and time, error over seconds, with the Pareto front."""

from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING

from brushgs.measure.bench.figures import Bench, Family, Point
from brushgs.measure.plotting import BLUE, GREEN, PURPLE, VERMILION, label, new_figure, save_figure
from brushgs.stroke_count.curve import Knee

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLORS = (BLUE, VERMILION, GREEN, PURPLE)  # of the series of a family
COLUMNS, PANEL_WIDTH, PANEL_HEIGHT = 3, 3.4, 2.7  # inches
DOTS_PER_INCH = 110  # low, so that a page of many scenes stays small
WIDE = 15.0  # ratio of largest to smallest error above which the axis is logarithmic
FLOOR = 0.3  # of the smallest error above zero: position of zero errors on a logarithmic axis


def write_plot(result: Bench, path: Path, title: str) -> None:
    """Draw the plot to a PNG, written atomically.

    Raises:
        ValueError: if matplotlib is not installed.
        SceneError: if the file cannot be written.
    """
    panels = [(family, kind) for family in result.families for kind in family.kinds]
    num = max(1, len(panels))
    columns = min(COLUMNS, num)
    lines = ceil(num / columns)
    figure = new_figure(PANEL_WIDTH * columns, PANEL_HEIGHT * lines + 0.3, title, DOTS_PER_INCH)
    places = figure.subplots(lines, columns, squeeze=False).ravel()
    for axes, (family, kind) in zip(places, panels, strict=False):
        _draw_family(axes, family, kind, result.knees.get(kind) if family.name == "strokes" else None)
    for axes in places[len(panels) :]:
        axes.axis("off")
    save_figure(figure, path)


def _draw_family(axes: "Axes", family: Family, kind: str, knee: Knee | None) -> None:
    """A panel: errors over one of the times, by series, with the front of that time.

    For strokes also the error of clustering, and as a line that of one stroke per Gaussian: the error of the
    brush.
    """
    errors = [255 * point.error.rmse for point in family.points]
    above = [error for error in errors if error > 0]
    smallest = min(above, default=1.0)
    is_wide = max(above, default=1.0) / smallest > WIDE
    floor = FLOOR * smallest if is_wide else 0.0
    shown = {id(point): max(error, floor) for point, error in zip(family.points, errors, strict=True)}
    clusters = [(_ms(p, kind), 255 * p.clustering) for p in family.points if p.clustering is not None]
    by_series: dict[str, list[Point]] = {}
    for point in family.points:
        by_series.setdefault(point.series, []).append(point)
    for number, (series, points) in enumerate(by_series.items()):
        name = "total" if clusters else series
        _draw_series(axes, points, kind, shown, COLORS[number % len(COLORS)], name)
    if clusters:
        x, y = zip(*clusters, strict=True)
        axes.plot(x, y, "-s", color=VERMILION, linewidth=1.0, markersize=2.5, label="clustering")
        axes.axhline(errors[-1], color=GREEN, linewidth=1.0, linestyle="--", label="brush, all Gaussians")
    _draw_front(axes, family, kind, shown)
    _label_axes(
        axes, family, kind, None if is_wide else max([*errors, *(error for _, error in clusters), 1e-9])
    )
    axes.margins(x=0.16)
    if len(by_series) > 1 or clusters:
        axes.legend(fontsize=6, frameon=False)
    if knee is not None:
        _draw_knee(axes, family, kind, knee)


def _draw_front(axes: "Axes", family: Family, kind: str, shown: dict[int, float]) -> None:
    front = family.front(kind)
    axes.plot(
        [_ms(point, kind) for point in front],
        [shown[id(point)] for point in front],
        color="black",
        linewidth=0.8,
        linestyle=":",
        drawstyle="steps-post",
        zorder=1,
    )


def _label_axes(axes: "Axes", family: Family, kind: str, largest: float | None) -> None:
    """Names and scales of the axes, up to the largest error; logarithmic if that is None."""
    cost = "a whole painting" if kind == "painting" else family.cost
    label(axes, f"ms of {cost}", "RMSE (of 255)", family.title)
    costs = [_ms(point, kind) for point in family.points]
    if max(costs) > 2 * min(costs):
        axes.set_xscale("log")
        _plain_ticks(axes.xaxis)
    if largest is None:
        axes.set_yscale("log")
    else:
        axes.set_ylim(0, 1.15 * largest)


def _draw_series(
    axes: "Axes", points: list[Point], kind: str, shown: dict[int, float], color: str, name: str
) -> None:
    times = [point.seconds[kind] for point in points]
    x, y = [1000 * time.median for time in times], [shown[id(point)] for point in points]
    below = [1000 * (time.median - time.q1) for time in times]
    above = [1000 * (time.q3 - time.median) for time in times]
    is_curve = all(point.value is not None for point in points)
    axes.errorbar(
        x, y, xerr=[below, above], color=color, linewidth=1.0 if is_curve else 0, elinewidth=0.8, label=name
    )
    for number, (point, across, up) in enumerate(zip(points, x, y, strict=True)):
        fill = color if kind in point.best_by else "white"
        axes.plot(across, up, "o", color=color, markerfacecolor=fill, markersize=4.5, zorder=3)
        text = point.label.removeprefix(f"{point.series}, ") + (" = 0" if point.error.rmse == 0 else "")
        place = 3, (3 if number % 2 == 0 else -8)  # labels of neighbors alternate above and below
        axes.annotate(text, (across, up), place, textcoords="offset points", fontsize=5.5)


def _draw_knee(axes: "Axes", family: Family, kind: str, knee: Knee) -> None:
    """A ring at the number of strokes of the knee, on its curve between its neighbors."""
    points = sorted(family.points, key=lambda point: point.strokes)
    left = max((p for p in points if p.strokes <= knee.strokes), key=lambda p: p.strokes, default=points[0])
    right = min((p for p in points if p.strokes >= knee.strokes), key=lambda p: p.strokes, default=points[-1])
    span = right.strokes - left.strokes
    share = (knee.strokes - left.strokes) / span if span else 0.0
    x = _ms(left, kind) ** (1 - share) * _ms(right, kind) ** share
    y = 255 * 10 ** (-knee.psnr / 20)
    axes.plot(x, y, "o", color="black", markerfacecolor="none", markersize=9, zorder=4)
    axes.annotate(
        f"knee {knee.strokes:,}", (x, y), (6, 8), textcoords="offset points", fontsize=6, weight="bold"
    )


def _plain_ticks(axis: object) -> None:
    """Ticks at 1, 2, 5, 10 on a logarithmic axis instead of powers of ten."""
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))  # type: ignore[attr-defined]
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))  # type: ignore[attr-defined]
    axis.set_minor_formatter(NullFormatter())  # type: ignore[attr-defined]


def _ms(point: Point, kind: str) -> float:
    return 1000 * point.seconds[kind].median
