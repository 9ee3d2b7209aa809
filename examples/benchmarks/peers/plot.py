"""The figures as a plot: nearness over seconds, stillness over nearness to the painting."""

from pathlib import Path
from typing import TYPE_CHECKING

from brushgs.measure.plotting import COLORS, label, new_figure, save_figure
from examples.benchmarks.peers.figures import Peers, Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH, HEIGHT = 9.0, 3.8  # inches
TICKS = (0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500)  # seconds
MARKERS = "osD^vPX*<>h"


def write_plot(result: Peers, path: Path) -> None:
    """Draw the plot to a PNG, written atomically.

    Raises:
        ValueError: if matplotlib is not installed.
        SceneError: if the file cannot be written.
    """
    counts = ", ".join(f"{count:,}" for count in result.rows)
    figure = new_figure(WIDTH, HEIGHT, f"{result.scene}, {counts} strokes, in the style of {result.style}")
    first, second = figure.subplots(1, 2)
    _draw(first, result, "seconds", "psnr")
    label(first, "seconds of a whole command", "PSNR to the plain picture, dB", "Near and fast: upper left")
    _draw(second, result, "structure", "short_range")
    words = "distance to the painting's structure", "error between neighboring frames, RMSE of 255"
    label(second, *words, "In the style and still: lower left")
    first.set_xscale("log")
    first.set_xticks([tick for tick in TICKS if _is_near(tick, result)], minor=False)
    first.xaxis.set_major_formatter("{x:g}")
    first.xaxis.set_minor_formatter("")
    handles, names = second.get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=5, fontsize=7, frameon=False)
    save_figure(figure, path)


def _draw(axes: "Axes", result: Peers, across: str, up: str) -> None:
    """A point for each peer and number of strokes; larger for more strokes."""
    peers = list(dict.fromkeys(row.peer for rows in result.rows.values() for row in rows))
    for number, (count, rows) in enumerate(sorted(result.rows.items())):
        for row in rows:
            x, y = (_value(row, name) for name in (across, up))
            if x is None or y is None:
                continue
            place = peers.index(row.peer)
            axes.scatter(
                [x],
                [y],
                s=26 + 30 * number,
                color=COLORS[place % len(COLORS)],
                marker=MARKERS[place % len(MARKERS)],
                label=row.peer if count == min(result.rows) else None,
                zorder=3,
            )


def _value(row: Row, name: str) -> float | None:
    value: float | None = getattr(row, name)
    return value


def _is_near(tick: float, result: Peers) -> bool:
    """Whether some time is within a factor of three of a tick."""
    seconds = [row.seconds for rows in result.rows.values() for row in rows if row.seconds]
    return any(tick / 3 < each < 3 * tick for each in seconds)
