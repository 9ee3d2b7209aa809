"""The stages that choose the number of strokes if the options give a target instead of a count.

Targets are the knee of error over cost ("auto"), an error budget and a stroke size. `stroke_count` estimates
the count: final for the knee, the start of the search for the others.
"""

import warnings
from typing import TYPE_CHECKING

import numpy as np

from brushgs.errors import SceneWarning
from brushgs.options.painting import ClusterConfig
from brushgs.options.stroke_target import ErrorBudget, StrokeSize
from brushgs.pipeline.background import Background
from brushgs.pipeline.report import Report, Stage
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.brushes.brush_set import Brushes
    from brushgs.rendering.options import RenderOptions
    from brushgs.stroke_count.choose import Choice
    from brushgs.stroke_count.search import Cluster, Found
    from brushgs.stroke_count.view_model import ViewModel


def open_view_model(
    gaussians: Gaussians,
    camera: Camera,
    texture: "Brushes",
    options: "RenderOptions",
    background: Background,
    report: Report,
) -> "ViewModel":
    """Render the plain picture of the whole scene, the truth for stroke counts.

    Args:
        gaussians: the scene as loaded.
        camera: the view.
        texture: the stroke.
        options: how strokes become a frame.
        background: behind the strokes; None counts as white.
        report: gets the stage.
    """
    with report.stage("plain") as stage:
        from brushgs.brushes.texture import StrokeTexture
        from brushgs.rendering.render import render
        from brushgs.stroke_count.view_model import ViewModel

        kernel = StrokeTexture.open("gaussian")
        plain = render(gaussians, camera, kernel, depth=False, num_threads=options.num_threads)
        stage.did = f"the plain picture of {len(gaussians):,} Gaussians, to choose the number of strokes"
        stage.counts = {"gaussians": len(gaussians), "width": camera.width, "height": camera.height}
        shown_on = np.ones(3) if background is None else np.asarray(background)
        return ViewModel(camera, texture, options, plain, shown_on)


def choose_count(
    gaussians: Gaussians,
    config: ClusterConfig,
    view_model: "ViewModel",
    report: Report,
    *,
    are_changed: bool = False,
) -> "Choice":
    """Estimate the number of strokes that meets the target.

    Args:
        gaussians: the scene, pruned.
        config: target, and how Gaussians are merged.
        view_model: the view of the target.
        report: gets the stage.
        are_changed: whether strokes are changed after clustering, see `choose_for_view_model`.
    """
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
            cost=config.cost,
            are_changed=are_changed,
        )
        stage.did = f"{choice.strokes:,} strokes: {_explain(choice, 'at least ' if are_changed else '')}"
        stage.counts = {
            "target": str(target),
            "strokes": choice.strokes,
            "psnr_expected": round(choice.psnr, 3),
            "size_expected": round(choice.size, 2),
            "sampled": [int(count) for count in choice.curve.strokes],
        }
        if choice.knee is not None:
            stage.counts["gain_of_doubling"] = round(choice.knee.gain_of_doubling, 3)
            stage.counts["cost_of_doubling"] = round(choice.knee.cost_of_doubling, 3)
    return choice


def _explain(choice: "Choice", at_least: str) -> str:
    """Why this count, in words; `at_least` if strokes will be better than the cells of the estimate."""
    if choice.rule == "size":
        return f"estimated to be {choice.size:.0f} px long"
    if choice.rule == "psnr":
        return f"estimated to reach {at_least}{choice.psnr:.1f} dB"
    if choice.knee is None:
        return "one per Gaussian of so small a scene"
    if choice.knee.strokes == choice.curve.strokes[-1] and choice.curve.ends_unmerged:
        return "all, since merging does not pay"
    gain, cost = choice.knee.gain_of_doubling, choice.knee.cost_of_doubling
    doubling = f"doubling gains {gain:.1f} dB for {cost:.1f} x the time"
    of_what = " before the brush" if choice.curve.ends_unmerged else ""
    return f"the knee, where {doubling}; expected {at_least}{choice.psnr:.1f} dB{of_what}"


def cluster_to_target(
    num: int,
    target: ErrorBudget | StrokeSize,
    view_model: "ViewModel",
    choice: "Choice",
    cluster: "Cluster",
    *,
    are_changed: bool = False,
) -> "Found":
    """Cluster `num` Gaussians until the strokes meet a budget or a size; see `stroke_count.search`."""
    from brushgs.stroke_count.search import search_budget, search_size

    if isinstance(target, ErrorBudget):
        return search_budget(num, target.psnr, view_model, choice, cluster, descends=are_changed)
    return search_size(target.pixels, view_model, choice, cluster)


def describe_search(found: "Found", target: ErrorBudget | StrokeSize, stage: Stage) -> None:
    """Report the result of a search, and warn of a missed size."""
    from brushgs.stroke_count.search import SIZE_TOLERANCE

    stage.counts |= {"tries": found.tries, "size": round(found.size, 2), "psnr": round(found.psnr, 3)}
    is_size = isinstance(target, StrokeSize)
    reached = f"{found.size:.0f} px" if is_size else f"{found.psnr:.1f} dB"
    stage.did += f"; {reached} reached at the {_ordinal(found.tries)} count tried"
    if isinstance(target, StrokeSize) and abs(found.size / target.pixels - 1) > 2 * SIZE_TOLERANCE:
        sentence = f"strokes of {target} are not possible in this view; these are {found.size:.1f} px long"
        warnings.warn(SceneWarning(f"{sentence}; {_size_cure(found.size, target)}"), stacklevel=2)


def _size_cure(size: float, target: StrokeSize) -> str:
    """What to do if strokes are `size` pixels long and the target cannot be reached."""
    if size == 0:
        return "nothing is visible: check that the camera and the scene belong together"
    nearest = f"take --stroke-size {size:.2g}px" if size < 10 else f"take --stroke-size {size:.0f}px"
    if size > target.pixels:  # not even one stroke per Gaussian is small enough
        return (
            f"{nearest}, paint a smaller picture (--size) or a smaller --zoom, or keep more with --keep 100%"
        )
    return f"{nearest}, or paint a larger picture (--size) or a larger --zoom"


def _ordinal(number: int) -> str:
    return ("first", "second", "third")[number - 1] if number < 4 else f"{number}th"
