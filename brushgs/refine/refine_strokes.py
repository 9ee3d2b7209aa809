"""The stage that refines: strokes toward the plain picture of their scene, or toward a style image."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from brushgs.options.experiments import RefineConfig
from brushgs.refine.distil import distil, mean_psnr
from brushgs.refine.fit import Drawing, FitSchedule
from brushgs.refine.painting_style import at_size
from brushgs.refine.report import Refinement, RefineReport
from brushgs.refine.style import EVALUATIONS, LAID_RATES, RATES, style_of, stylise
from brushgs.refine.targets import TargetView
from brushgs.refine.variables import Rates, Variables
from brushgs.values.arrays import Array
from brushgs.values.gaussians import Gaussians


class StyleTarget(NamedTuple):
    """A style image as the target."""

    painting: Array  # [H, W, 3] 0 to 1, of any size
    is_laid: bool  # whether the strokes were already laid as its marks


def refine_strokes(
    variables: Variables,
    views: tuple[Sequence[TargetView], Sequence[TargetView]],
    drawing: Drawing,
    schedule: FitSchedule,
    config: RefineConfig,
    report: RefineReport,
    style: StyleTarget | None = None,
) -> Gaussians:
    """Refine strokes as one stage of a report; the figures become `report.result`.

    Args:
        variables: the strokes, and which of them may change.
        views: for training, and for validation.
        drawing: how strokes are drawn.
        schedule: how long; its rates are replaced.
        config: params, style loss and factors of the rates.
        report: gets the stage.
        style: the target; None for the plain picture.
    """
    training_views, validation_views = views
    moves, num = variables.moves, len(variables.strokes)
    with report.stage("refine", total=schedule.steps, unit="steps") as stage:
        before = mean_psnr(variables.strokes, validation_views, drawing)
        resumed_from = None if schedule.checkpoint is None else schedule.checkpoint.step

        def on_step(score: float) -> None:
            report.advance(f"{score:.2f} dB")

        if style is None:
            schedule = replace(schedule, rates=Rates().times(config.parameter_rates))
            refined, curve = distil(variables, training_views, validation_views, drawing, schedule, on_step)
        else:
            shorter = min(training_views[0].alpha.shape)
            features = style_of(
                at_size(style.painting, shorter),
                config.weights,
                schedule.seed,
                kind=config.style_loss,
                layers=config.style_layers,
            )
            rates = (LAID_RATES if style.is_laid else RATES).times(config.parameter_rates)
            schedule = replace(schedule, rates=rates, evaluations=EVALUATIONS)
            refined, curve = stylise(
                variables,
                (training_views, validation_views),
                features,
                style.painting,
                drawing,
                schedule,
                on_step=on_step,
            )
        after = mean_psnr(refined, validation_views, drawing)
        report.result = Refinement(
            config.params,
            num,
            int(moves.sum()),
            before,
            after,
            curve.stopped,
            style is not None,
            tuple(curve.steps),
            tuple(curve.seconds),
            tuple(curve.losses),
            tuple(curve.scores),
        )
        stage.did = _in_words(report.result, config, len(validation_views), resumed_from)
        stage.counts = _counts(report.result)
        if not moves.all():
            stage.skipped.append(f"{int((~moves).sum()):,} strokes outside {config.where}: not touched")
    return refined


def _in_words(result: Refinement, config: RefineConfig, num_views: int, resumed_from: int | None) -> str:
    """A summary of the stage in words."""
    words = (
        f"{result.moved:,} strokes, {config.params}: {result.psnr_before:.2f} to {result.psnr_after:.2f} dB "
        f"to the plain picture in {num_views} other views; {result.stopped}"
    )
    if resumed_from is not None:
        words += f"; resumed from step {resumed_from:,}"
    if config.style is not None:
        names = ", ".join(file.name for file in config.style.files)
        decrease = 1 - 10 ** (-(max(result.scores) - result.scores[0]) / 10)
        words += f"; the loss to {names} fell by {decrease:.0%}"
    return words


def _counts(result: Refinement) -> dict[str, Any]:
    """The figures of the stage."""
    figures = result.as_dict()
    counts = {name: figures[name] for name in ("params", "moved", "psnr_before", "psnr_after", "stopped")}
    return counts | {f"curve_{name}": figures[name] for name in ("steps", "seconds", "losses", "scores")}
