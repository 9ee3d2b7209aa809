"""What a refinement found, as figures, as JSON and as a plot: the curve, pictures before and after."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from brushgs.arrays import Array
from brushgs.measure.plotting import BLUE, VERMILION, label, new_figure, save_figure
from brushgs.measure.report import ExperimentReport
from brushgs.options.choices import Params

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Console

# Version of the JSON; increases when a key changes its name or meaning. Since 2 a stage has `skipped` in
# place of `left_out`.
SCHEMA = 2
WIDTH, CURVES_HEIGHT = 9.0, 2.3  # inches


@dataclass(frozen=True)
class Refinement:
    """A refinement in figures.

    Attributes:
        params: what moved.
        strokes: in all.
        moved: of them.
        psnr_before: dB to the plain picture, mean over views that were not learned from.
        psnr_after: the same, afterwards.
        stopped: why the fit ended.
        is_styled: whether it went toward a style image, and scores are of that.
        steps: [M] done until each look.
        seconds: [M] of steps until then.
        losses: [M] mean since the look before; NaN where no step was done yet.
        scores: [M] what the look found: dB to the plain picture, or -10 log10 of the loss to the style image.
    """

    params: Params
    strokes: int
    moved: int
    psnr_before: float
    psnr_after: float
    stopped: str
    is_styled: bool
    steps: tuple[int, ...]
    seconds: tuple[float, ...]
    losses: tuple[float, ...]
    scores: tuple[float, ...]

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON; a loss that is not there is null."""
        return asdict(self) | {"losses": [loss if np.isfinite(loss) else None for loss in self.losses]}


@dataclass
class RefineReport(ExperimentReport):
    """A run, and what it found: `result` is a `Refinement`."""

    name: ClassVar[str] = "refine"
    schema: ClassVar[int] = SCHEMA

    def print_figures(self, console: "Console") -> None:
        """Nothing: the line of the stage has them."""


def write_plot(result: Refinement, pictures: dict[str, Array], path: Path, title: str) -> None:
    """Draw the plot to a PNG, which appears when it is whole.

    Args:
        result: the figures.
        pictures: [H, W, 3] in 0 to 1, all of one size, by what they show.
        path: file to write.
        title: on top.

    Raises:
        ValueError: if matplotlib is not installed.
        SceneError: if the file cannot be written.
    """
    from matplotlib.gridspec import GridSpec

    height, width, _ = next(iter(pictures.values())).shape
    figure = new_figure(WIDTH, CURVES_HEIGHT + 0.35 + WIDTH / len(pictures) * height / width, title)
    grid = GridSpec(2, 1, figure, height_ratios=(CURVES_HEIGHT, WIDTH / len(pictures) * height / width))
    _draw_curves(figure, grid[0], result)
    shown = grid[1].subgridspec(1, len(pictures))
    for place, (name, picture) in enumerate(pictures.items()):
        axes = figure.add_subplot(shown[place])
        axes.imshow(np.clip(picture, 0, 1))
        axes.set_title(name, fontsize=8)
        axes.set_axis_off()
    save_figure(figure, path, in_full_color=True)


def _draw_curves(figure: "Figure", place: Any, result: Refinement) -> None:
    """Score and loss against seconds, side by side."""
    score, loss = (figure.add_subplot(part) for part in place.subgridspec(1, 2))
    seconds = list(result.seconds)
    score.plot(seconds, list(result.scores), color=BLUE, linewidth=1.3, marker=".")
    what = "-10 log10 of the loss to the style" if result.is_styled else "PSNR to the plain picture (dB)"
    label(score, "seconds of steps", what, "Views that were not learned from")
    loss.plot(seconds, list(result.losses), color=VERMILION, linewidth=1.3, marker=".")
    label(loss, "seconds of steps", "loss", "Views that were learned from, mean since the look before")
