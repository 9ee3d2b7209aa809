"""How many strokes a run makes where it is given an aim in place of a count: the knee, a budget, a size.

`stroke_count` chooses by a quick look. The knee is left at that. A budget is a promise and a size is measured
in the picture, so there the clusters themselves are held against the aim, and clustered again where they miss
it.
"""

import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from brushgs.errors import SceneWarning
from brushgs.options.painting import ClusterConfig, ErrorBudget, StrokeSize
from brushgs.painting.background import Ground
from brushgs.painting.report import Report, Stage
from brushgs.scene import Camera, Gaussians

if TYPE_CHECKING:
    from brushgs.brushes.texture import StrokeTexture
    from brushgs.rendering.options import RenderOptions
    from brushgs.stroke_count.choose import Choice
    from brushgs.stroke_count.view_model import ViewModel

# Clusters come as near as the cells of the quick look at 0.7 to 1.4 of their count, mostly: the search for
# the fewest that meet a budget starts a step below, and goes up by steps of a fifth.
STEP = 2**0.25
START = 1 / STEP
SIZE_TOLERANCE, SIZE_TRIES = 0.05, 4  # of the length asked for; clusterings


def look(
    gaussians: Gaussians,
    camera: Camera,
    texture: "StrokeTexture",
    config: ClusterConfig,
    options: "RenderOptions",
    ground: Ground,
    report: Report,
) -> "ViewModel | None":
    """The plain picture of the whole scene, for what strokes are counted; None where their count is given."""
    if config.target is None:
        return None
    with report.stage("plain") as stage:
        from brushgs.brushes.texture import StrokeTexture
        from brushgs.rendering.render import render
        from brushgs.stroke_count.view_model import ViewModel

        kernel = StrokeTexture.open("gaussian")
        plain = render(gaussians, camera, kernel, depth=False, num_threads=options.num_threads)
        stage.did = f"the plain picture of {len(gaussians):,} Gaussians, to count strokes for"
        stage.counts = {"gaussians": len(gaussians), "width": camera.width, "height": camera.height}
        on = np.ones(3) if ground is None else np.asarray(ground)
        return ViewModel(camera, texture, options, plain, on)


def choose(gaussians: Gaussians, config: ClusterConfig, view_model: "ViewModel", report: Report) -> "Choice":
    """How many strokes to begin with."""
    with report.stage("count") as stage:
        from brushgs.stroke_count.choose import choose_for_view_model

        target = config.target
        choice = choose_for_view_model(
            gaussians,
            view_model,
            psnr=target.psnr if isinstance(target, ErrorBudget) else None,
            size=target.pixels if isinstance(target, StrokeSize) else None,
            features=config.features,
            merge=config.merge,
        )
        stage.did = f"{choice.strokes:,} strokes: {reason(choice)}"
        stage.counts = {
            "aim": str(target),
            "strokes": choice.strokes,
            "psnr_expected": round(choice.psnr, 3),
            "size_expected": round(choice.size, 2),
            "looks": [int(count) for count in choice.curve.strokes],
        }
        if choice.knee is not None:
            stage.counts["gain_of_doubling"] = round(choice.knee.gain_of_doubling, 3)
            stage.counts["cost_of_doubling"] = round(choice.knee.cost_of_doubling, 3)
    return choice


def reason(choice: "Choice") -> str:
    """Why so many, in words."""
    if choice.rule == "size":
        return f"cells of so many are {choice.size:.0f} px long"
    if choice.rule == "psnr":
        return f"cells of so many come to {choice.psnr:.1f} dB"
    if choice.knee is None:
        return "every Gaussian of so small a scene"
    gain, cost = choice.knee.gain_of_doubling, choice.knee.cost_of_doubling
    bought = f"doubling buys {gain:.1f} dB for {cost:.1f} x the time"
    return f"the knee, where {bought}; expected {choice.psnr:.1f} dB"


def _ordinal(number: int) -> str:
    return ("first", "second", "third")[number - 1] if number < 4 else f"{number}th"


def make(
    gaussians: Gaussians,
    config: ClusterConfig,
    view_model: "ViewModel",
    choice: "Choice",
    cluster: Callable[[int], Gaussians],
    stage: Stage,
) -> Gaussians:
    """Strokes that meet the aim; tells in the stage what was reached, and in how many clusterings."""
    if isinstance(config.target, ErrorBudget):
        made, tries = _within_budget(len(gaussians), config.target.psnr, view_model, choice, cluster)
    elif isinstance(config.target, StrokeSize):
        made, tries = _of_size(config.target.pixels, view_model, choice, cluster)
    else:
        return cluster(choice.strokes)
    from brushgs.stroke_count.curve import psnr_of

    boxes = view_model.boxes(made)
    size, psnr = view_model.size(boxes), psnr_of(view_model.rmse(boxes))
    stage.counts |= {"tries": tries, "size": round(size, 2), "psnr": round(psnr, 3)}
    reached = f"{size:.0f} px" if choice.rule == "size" else f"{psnr:.1f} dB"
    stage.did += f"; {reached} reached at the {_ordinal(tries)} count tried"
    if isinstance(config.target, StrokeSize) and abs(size / config.target.pixels - 1) > 2 * SIZE_TOLERANCE:
        warnings.warn(
            SceneWarning(
                f"strokes of {config.target} cannot be had in this view; these come to {size:.1f} px"
            ),
            stacklevel=2,
        )
    return made


def _within_budget(
    num: int, psnr: float, view_model: "ViewModel", choice: "Choice", cluster: Callable[[int], Gaussians]
) -> tuple[Gaussians, int]:
    """The first on a ladder of counts that comes near enough.

    The steps of the ladder are the same whatever the budget, so a stricter one never gives fewer strokes.
    """
    from brushgs.stroke_count.curve import psnr_of

    step, tries = int(np.ceil(np.log(max(1.0, START * choice.strokes)) / np.log(STEP))), 0
    while True:
        count, tries, step = min(num, round(STEP**step)), tries + 1, step + 1
        made = cluster(count)
        if count == num or psnr_of(view_model.rmse(view_model.boxes(made))) >= psnr:
            return made, tries


def _of_size(
    pixels: float, view_model: "ViewModel", choice: "Choice", cluster: Callable[[int], Gaussians]
) -> tuple[Gaussians, int]:
    """Clusters of the count at which cells would be as much too large or small as the last clusters were."""
    tried: dict[int, tuple[float, Gaussians]] = {}
    count, target = choice.strokes, pixels
    while count not in tried:
        made = cluster(count)
        size = view_model.size(view_model.boxes(made))
        tried[count] = abs(np.log(max(size, 1e-9) / pixels)), made
        if tried[count][0] <= SIZE_TOLERANCE or len(tried) == SIZE_TRIES or size == 0:
            break
        target *= pixels / size
        count = choice.count_of_size(target)
    return min(tried.values(), key=lambda value: value[0])[1], len(tried)
