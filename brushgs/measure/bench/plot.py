"""The curves as a plot: one panel per family, error over seconds, with the Pareto front."""

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
FLOOR = 0.3  # of the smallest error above zero: where errors of zero are drawn on a logarithmic axis


def write_plot(result: Bench, path: Path, title: str) -> None:
    """Draw the plot to a PNG, written atomically.

    Raises:
        ValueError: if matplotlib is not installed.
        SceneError: if the file cannot be written.
    """
    num = max(1, len(result.families))
    columns = min(COLUMNS, num)
    lines = ceil(num / columns)
    figure = new_figure(PANEL_WIDTH * columns, PANEL_HEIGHT * lines + 0.3, title, DOTS_PER_INCH)
    panels = figure.subplots(lines, columns, squeeze=False).ravel()
    for axes, family in zip(panels, result.families, strict=False):
        _draw_family(axes, family, result.knee if family.name == "strokes" else None)
    for axes in panels[len(result.families) :]:
        axes.axis("off")
    save_figure(figure, path)


def _draw_family(axes: "Axes", family: Family, knee: Knee | None) -> None:
    errors = [255 * point.error.rmse for point in family.points]
    above = [error for error in errors if error > 0]
    floor = FLOOR * min(above, default=1.0)
    is_wide = bool(above) and (max(above) / min(above) > WIDE)
    shown = {id(p): max(e, floor) if is_wide else e for p, e in zip(family.points, errors, strict=True)}
    for number, series in enumerate(dict.fromkeys(point.series for point in family.points)):
        points = [point for point in family.points if point.series == series]
        _draw_series(axes, points, shown, COLORS[number % len(COLORS)], series)
    front = family.best
    axes.plot(
        [_ms(point) for point in front],
        [shown[id(point)] for point in front],
        color="black",
        linewidth=0.8,
        linestyle=":",
        drawstyle="steps-post",
        zorder=1,
    )
    label(axes, f"ms of {family.cost}", "RMSE (of 255)", family.title)
    costs = [_ms(point) for point in family.points]
    if max(costs) > 2 * min(costs):
        axes.set_xscale("log")
        _plain_ticks(axes.xaxis)
    if is_wide:
        axes.set_yscale("log")
    else:
        axes.set_ylim(0, 1.15 * max([*errors, 1e-9]))
    axes.margins(x=0.16)
    if len({point.series for point in family.points}) > 1:
        axes.legend(fontsize=6, frameon=False)
    if knee is not None:
        _draw_knee(axes, family, knee)


def _draw_series(axes: "Axes", points: list[Point], shown: dict[int, float], color: str, series: str) -> None:
    x, y = [_ms(point) for point in points], [shown[id(point)] for point in points]
    below = [1000 * (point.cost.median - point.cost.q1) for point in points]
    above = [1000 * (point.cost.q3 - point.cost.median) for point in points]
    is_curve = all(point.value is not None for point in points)
    axes.errorbar(
        x, y, xerr=[below, above], color=color, linewidth=1.0 if is_curve else 0, elinewidth=0.8, label=series
    )
    for number, (point, across, up) in enumerate(zip(points, x, y, strict=True)):
        fill = color if point.is_best else "white"
        axes.plot(across, up, "o", color=color, markerfacecolor=fill, markersize=4.5, zorder=3)
        text = point.label.removeprefix(f"{series}, ") + (" = 0" if point.error.rmse == 0 else "")
        place = 3, (3 if number % 2 == 0 else -8)  # labels of neighbours alternate above and below
        axes.annotate(text, (across, up), place, textcoords="offset points", fontsize=5.5)


def _draw_knee(axes: "Axes", family: Family, knee: Knee) -> None:
    """A ring at the number of strokes of the knee, on the line between its neighbours."""
    points = sorted(family.points, key=lambda point: point.strokes)
    left = max((p for p in points if p.strokes <= knee.strokes), key=lambda p: p.strokes, default=points[0])
    right = min((p for p in points if p.strokes >= knee.strokes), key=lambda p: p.strokes, default=points[-1])
    span = right.strokes - left.strokes
    share = (knee.strokes - left.strokes) / span if span else 0.0
    x = _ms(left) ** (1 - share) * _ms(right) ** share
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


def _ms(point: Point) -> float:
    return 1000 * point.cost.median
