"""The temporal report as a picture: error along the path, excess by gap. Only here matplotlib is loaded."""

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from brushgs.errors import SceneError
from brushgs.io.atomic import replacing
from brushgs.stability.figures import Stability

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Okabe and Ito 2008: told apart by the colour-blind, too.
COLORS = {
    "track": "#0072B2",
    "anchor": "#56B4E9",
    "off": "#009E73",
    "published": "#D55E00",
    "image": "#CC79A7",
    "plain": "#777777",
}
WIDTH, HEIGHT = 9.0, 3.4  # inches
DOTS = 160  # per inch


def check_plot() -> None:
    """Refuse a plot that cannot be drawn, before the work for it is done.

    Raises:
        ValueError: if matplotlib is not installed.
    """
    if find_spec("matplotlib") is None:
        raise ValueError(
            "the plot needs matplotlib, which is not installed; pip install 'brushgs[plot]', or leave the "
            "plot out with --no-plot"
        )


def write_plot(result: Stability, path: Path, title: str) -> None:
    """Draw the plot to a PNG, which appears when it is whole.

    Raises:
        ValueError: if matplotlib is not installed.
        SceneError: if the file cannot be written.
    """
    check_plot()
    # Not pyplot: it would pick a window system and keep figures in a global list.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, HEIGHT), dpi=DOTS, layout="constrained")
    FigureCanvasAgg(figure)
    along, by_gap = figure.subplots(1, 2, width_ratios=(1.6, 1))
    _draw_errors(along, result)
    _draw_excess(by_gap, result)
    figure.suptitle(title, fontsize=9, x=0.01, horizontalalignment="left")
    with replacing(path) as temporary:
        # Without the date and the version equal reports give equal files.
        figure.savefig(temporary, format="png", metadata={"Software": None})
        if temporary.stat().st_size == 0:
            raise SceneError(path, "cannot be written whole; check the space on the disk")


def _draw_errors(axes: "Axes", result: Stability) -> None:
    """RMSE at gap 1 along the path, one line per configuration."""
    for figures in result.configurations:
        style = "--" if figures.name == "plain" else "-"
        errors = [255 * error for error in figures.errors]
        axes.plot(
            list(result.starts),
            errors,
            style,
            color=COLORS[figures.name],
            linewidth=1.3,
            zorder=4 if figures.name == "track" else 3,  # ours lies on top of what it falls together with
            label=figures.name,
            marker="." if len(errors) < 3 else None,
        )
    _label(axes, "frame", "error at gap 1 (RMSE, of 255)", "Along the path")
    axes.set_xlim(0, result.num_frames - 1)
    axes.legend(fontsize=7, ncols=3, frameon=False, loc="upper left")
    axes.set_ylim(0, 1.28 * axes.get_ylim()[1])  # room for the legend


def _draw_excess(axes: "Axes", result: Stability) -> None:
    """Mean excess of each gap, one bar per configuration, its number on top."""
    shown = [figures for figures in result.configurations if figures.name != "plain"]
    width = 0.8 / len(shown)
    gaps = [warp.gap for warp in shown[0].warps]
    for number, figures in enumerate(shown):
        places = [i + (number - (len(shown) - 1) / 2) * width for i in range(len(gaps))]
        heights = [255 * warp.excess for warp in figures.warps]
        bars = axes.bar(places, heights, width * 0.92, color=COLORS[figures.name])
        axes.bar_label(bars, fmt="%.1f", fontsize=6, padding=1)
    _label(axes, "gap (frames)", "excess over the plain render (of 255)", "Mean over the path")
    axes.set_xticks(range(len(gaps)), [str(gap) for gap in gaps])
    axes.axhline(0, color="black", linewidth=0.6)


def _label(axes: "Axes", x: str, y: str, title: str) -> None:
    axes.set_title(title, fontsize=8)
    axes.set_xlabel(x, fontsize=8)
    axes.set_ylabel(y, fontsize=8)
    axes.tick_params(labelsize=7)
    axes.grid(axis="y", linewidth=0.4, alpha=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
