"""The temporal report as a plot: error along the path, excess by gap."""

from pathlib import Path
from typing import TYPE_CHECKING

from brushgs.measure.plotting import BLUE, GREEN, GREY, PURPLE, SKY, VERMILION, label, new_figure, save_figure
from brushgs.measure.stability.figures import Stability

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLORS = {
    "track": BLUE,
    "anchor": SKY,
    "off": GREEN,
    "published": VERMILION,
    "alone": VERMILION,  # no path has both
    "plain": GREY,
}
EXTRA_COLOR = PURPLE  # of a configuration that the report does not have by itself
WIDTH, HEIGHT = 9.0, 3.4  # inches


def write_plot(result: Stability, path: Path, title: str) -> None:
    """Draw the plot to a PNG, written atomically.

    Raises:
        ValueError: if matplotlib is not installed.
        SceneError: if the file cannot be written.
    """
    figure = new_figure(WIDTH, HEIGHT, title)
    along, by_gap = figure.subplots(1, 2, width_ratios=(1.6, 1))
    _draw_errors(along, result)
    _draw_excess(by_gap, result)
    save_figure(figure, path)


def _draw_errors(axes: "Axes", result: Stability) -> None:
    """RMSE at gap 1 along the path, one line per configuration."""
    for figures in result.configurations:
        style = "--" if figures.name == "plain" else "-"
        errors = [255 * error for error in figures.errors]
        axes.plot(
            list(result.starts),
            errors,
            style,
            color=COLORS.get(figures.name, EXTRA_COLOR),
            linewidth=1.3,
            zorder=4 if figures.name == "track" else 3,  # on top where lines coincide
            label=figures.name,
            marker="." if len(errors) < 3 else None,
        )
    label(axes, "frame", "error at gap 1 (RMSE, of 255)", "Along the path")
    axes.set_xlim(0, result.num_frames - 1)
    axes.legend(fontsize=7, ncols=3, frameon=False, loc="upper left")
    axes.set_ylim(0, 1.28 * axes.get_ylim()[1])  # room for the legend


def _draw_excess(axes: "Axes", result: Stability) -> None:
    """Mean excess at each gap, one labeled bar per configuration."""
    shown = [figures for figures in result.configurations if figures.name != "plain"]
    width = 0.8 / len(shown)
    gaps = [warp.gap for warp in shown[0].warps]
    for number, figures in enumerate(shown):
        places = [i + (number - (len(shown) - 1) / 2) * width for i in range(len(gaps))]
        heights = [255 * warp.excess for warp in figures.warps]
        bars = axes.bar(places, heights, width * 0.92, color=COLORS.get(figures.name, EXTRA_COLOR))
        axes.bar_label(bars, fmt="%.1f", fontsize=6, padding=1)
    label(axes, "gap (frames)", "excess over the plain picture (of 255)", "Mean over the path")
    axes.set_xticks(range(len(gaps)), [str(gap) for gap in gaps])
    axes.axhline(0, color="black", linewidth=0.6)
