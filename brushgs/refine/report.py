"""The result of a refinement: figures, JSON, and a plot of the curve with pictures before and after."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from brushgs.measure.plotting import BLUE, VERMILION, label, new_figure, save_figure
from brushgs.measure.report import ExperimentReport
from brushgs.options.choices import Params
from brushgs.values.arrays import Array

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
        params: fitted parameters.
        strokes: number of strokes.
        moved: number of strokes that could change.
        psnr_before: to the plain picture, in dB, mean over the validation views.
        psnr_after: the same after the fit.
        stopped: why the fit ended.
        is_styled: whether the target was a style image.
        steps: [M] steps done until each evaluation.
        seconds: [M] of these steps.
        losses: [M] mean of the steps since the previous evaluation; NaN before the first step.
        scores: [M] PSNR to the plain picture in dB, or -10 log10 of the loss to the style image.
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
        """Ready for JSON: NaN becomes null."""
        return asdict(self) | {"losses": [loss if np.isfinite(loss) else None for loss in self.losses]}


@dataclass
class RefineReport(ExperimentReport):
    """The report of a run: `result` is a `Refinement`."""

    name: ClassVar[str] = "refine"
    schema: ClassVar[int] = SCHEMA

    def print_figures(self, console: "Console") -> None:
        """Print nothing: the stage's line has the figures."""


def write_plot(result: Refinement, pictures: dict[str, Array], path: Path, title: str) -> None:
    """Write the plot as a PNG file, atomically.

    Args:
        result: the figures.
        pictures: title -> [H, W, 3] in 0 to 1, all of one size.
        path: file to write.
        title: of the whole plot.

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
    label(score, "seconds of steps", what, "Validation views")
    loss.plot(seconds, list(result.losses), color=VERMILION, linewidth=1.3, marker=".")
    label(loss, "seconds of steps", "loss", "Training views, mean since the previous evaluation")
