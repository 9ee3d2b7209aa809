"""What the plots of all reports share: colours, type, and how they become a file.

Only here matplotlib is loaded. Not pyplot: it would pick a window system and keep figures in a global list.
"""

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from brushgs.errors import SceneError
from brushgs.io.files import replacing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito 2008: told apart by the colour-blind, too.
BLUE, SKY, GREEN, VERMILION, PURPLE, ORANGE = "#0072B2", "#56B4E9", "#009E73", "#D55E00", "#CC79A7", "#E69F00"
GREY = "#777777"
DOTS = 160  # per inch
COLORS = (BLUE, SKY, GREEN, VERMILION, PURPLE, ORANGE, GREY, "#000000")
SHADES = 16  # of each in a file, from white on


def check_plot() -> None:
    """Refuse a plot that cannot be drawn, before the work for it is done.

    Raises:
        ValueError: if matplotlib is not installed.
    """
    if find_spec("matplotlib") is None:
        raise ValueError(
            "the plot needs matplotlib, which is not installed; pip install matplotlib, or skip the "
            "plot with --no-plot"
        )


def new_figure(width: float, height: float, title: str, dots: int = DOTS) -> "Figure":
    """An empty figure of so many inches.

    Raises:
        ValueError: if matplotlib is not installed.
    """
    check_plot()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=dots, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title, fontsize=9, x=0.01, horizontalalignment="left")
    return figure


def save_figure(figure: "Figure", path: Path) -> None:
    """Draw a figure to a PNG, which appears when it is whole. Equal figures give equal files.

    Raises:
        SceneError: if the file cannot be written.
    """
    from PIL import Image
    from PIL.ImageColor import getrgb

    figure.canvas.draw()
    pixels = np.asarray(figure.canvas.buffer_rgba())[..., :3]  # type: ignore[attr-defined]
    shades = np.linspace(0, 1, SHADES)[:, None]
    tables = [255 + shades * (np.array(getrgb(color)) - 255) for color in COLORS]
    palette = Image.new("P", (1, 1))
    palette.putpalette(np.rint(np.concatenate(tables)).astype(np.uint8).tobytes())
    # Each colour and its shades to white are all that lines on white need: a third of the bytes.
    picture = Image.fromarray(np.ascontiguousarray(pixels)).quantize(
        palette=palette, dither=Image.Dither.NONE
    )
    with replacing(path) as temporary:
        picture.save(temporary, format="png", optimize=True)
        if temporary.stat().st_size == 0:
            raise SceneError(path, "cannot be written whole; check the space on the disk")


def label(axes: "Axes", x: str, y: str, title: str) -> None:
    """Title and names of the axes in small type; lines across, and no frame on the right and above."""
    axes.set_title(title, fontsize=8)
    axes.set_xlabel(x, fontsize=8)
    axes.set_ylabel(y, fontsize=8)
    axes.tick_params(labelsize=7)
    axes.grid(axis="y", linewidth=0.4, alpha=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
