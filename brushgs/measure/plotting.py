"""Common parts of all plots: colors, fonts, and writing a figure to a file.

This is the only module that imports matplotlib. It avoids pyplot, which would choose a window system and keep
every figure in a global list.
"""

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.files import replacing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from PIL.Image import Image

# Colors that people with any kind of color blindness can tell apart. Source: Okabe and Ito 2008.
BLUE, SKY, GREEN, VERMILION, PURPLE, ORANGE = "#0072B2", "#56B4E9", "#009E73", "#D55E00", "#CC79A7", "#E69F00"
GREY = "#777777"
DOTS_PER_INCH = 160
COLORS = (BLUE, SKY, GREEN, VERMILION, PURPLE, ORANGE, GREY, "#000000")
SHADES = 16  # of each color in a file, from white to the full color


NO_MATPLOTLIB = "it needs matplotlib, which is not installed; pip install matplotlib"


def can_plot() -> bool:
    """Whether matplotlib is installed."""
    return find_spec("matplotlib") is not None


def check_plot() -> None:
    """Refuse a plot that cannot be drawn, before the work for it.

    Raises:
        ValueError: if matplotlib is not installed.
    """
    if not can_plot():
        raise ValueError(
            "the plot needs matplotlib, which is not installed; pip install matplotlib, or name a folder or "
            "a .json file: the figures need none"
        )


def new_figure(width: float, height: float, title: str, dots_per_inch: int = DOTS_PER_INCH) -> "Figure":
    """An empty figure; width and height in inches.

    Raises:
        ValueError: if matplotlib is not installed.
    """
    check_plot()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=dots_per_inch, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title, fontsize=9, x=0.01, horizontalalignment="left")
    return figure


def save_figure(figure: "Figure", path: Path, *, in_full_color: bool = False) -> None:
    """Draw a figure to a PNG, written atomically. Equal figures give equal files.

    Args:
        figure: made by `new_figure`.
        path: file to write.
        in_full_color: False stores only `COLORS` and their shades to white, enough for lines on white, in a
            third of the bytes; figures with pictures need all colors.

    Raises:
        SceneError: if the file cannot be written.
    """
    from PIL import Image

    figure.canvas.draw()
    pixels = np.asarray(figure.canvas.buffer_rgba())[..., :3]  # type: ignore[attr-defined]
    picture = Image.fromarray(np.ascontiguousarray(pixels))
    if not in_full_color:
        picture = picture.quantize(palette=_line_palette(), dither=Image.Dither.NONE)
    with replacing(path) as temporary:
        picture.save(temporary, format="png", optimize=True)
        if temporary.stat().st_size == 0:
            raise SceneError(path, "cannot be written completely; check the space on the disk")


def _line_palette() -> "Image":
    from PIL import Image
    from PIL.ImageColor import getrgb

    shades = np.linspace(0, 1, SHADES)[:, None]
    tables = [255 + shades * (np.array(getrgb(color)) - 255) for color in COLORS]
    palette = Image.new("P", (1, 1))
    palette.putpalette(np.rint(np.concatenate(tables)).astype(np.uint8).tobytes())
    return palette


def label(axes: "Axes", x: str, y: str, title: str) -> None:
    """Title and axis labels in a small font, a horizontal grid, no frame at the right and the top."""
    axes.set_title(title, fontsize=8)
    axes.set_xlabel(x, fontsize=8)
    axes.set_ylabel(y, fontsize=8)
    axes.tick_params(labelsize=7)
    axes.grid(axis="y", linewidth=0.4, alpha=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
