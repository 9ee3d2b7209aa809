"""`brushgs refine`: a scene file -> strokes -> refined strokes, written as a scene file.

stroke (-> palette) -> load -> prune -> cluster (-> recolor) -> views -> refine -> write
"""

import importlib.util
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from brushgs.arrays import Array
from brushgs.cameras.first_view import framed_camera, up_text
from brushgs.io.pictures.images import read_image
from brushgs.io.scenes.formats import SCENE_SUFFIXES
from brushgs.measure.report import plain_config, plain_paint
from brushgs.options.experiments import RefineConfig
from brushgs.options.painting import PaintConfig, PaletteConfig, ViewConfig
from brushgs.options.scene_source import SceneFiles
from brushgs.painting.outputs import check_output, input_files
from brushgs.painting.prepare import prepare
from brushgs.painting.report import Report
from brushgs.painting.strokes import name_of, write_scene
from brushgs.refine.checkpoint import Checkpoint, describe_fit
from brushgs.refine.report import Refinement, RefineReport, write_plot
from brushgs.scene import Camera, FirstView, Gaussians

if TYPE_CHECKING:
    from brushgs.refine.distil import TargetView
    from brushgs.refine.fit import Drawing, FitSchedule

NUM_VALIDATION_VIEWS = 6
# Training views. A picture of the scene takes milliseconds, and strokes overfit to few views.
SELF_VIEWS, STYLE_VIEWS = 320, 24
MOST_BYTES = 6e8  # of their target pictures: fewer views where these are larger, unless a number is given


def refine_file(
    scene: SceneFiles,
    output: str | Path,
    paint: PaintConfig | None = None,
    config: RefineConfig | None = None,
    *,
    report: RefineReport | None = None,
    folder: str | Path | None = None,
    wants_plot: bool = True,
) -> RefineReport:
    """Refine the strokes of a scene file; write them as a scene file.

    Args:
        scene: the files of a trained 3D Gaussian scene.
        output: scene file (.ply) to write.
        paint: how strokes are made and will be drawn; of its view only `up` is used.
        config: see `RefineConfig`. What is resumed is the checkpoint beside the output, see `checkpoint_of`;
            where there is none the fit starts anew, and a note says so.
        report: gets the stages and the figures; a new one if None.
        folder: gets `refine.json` and `refine.png`, the curve and the pictures before and after, and is made
            if missing; or one file that ends in .json or .png; None for neither.
        wants_plot: whether a folder gets the plot, if matplotlib is installed.

    Returns:
        The report, with one stage per step.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if an option does not suit the scene, or PyTorch or kornia is missing.
        KeyboardInterrupt: if the run is stopped; says how to resume it.
    """
    paint, config, report = paint or PaintConfig(), config or RefineConfig(), report or RefineReport()
    output, outputs = Path(output), None
    extras = tuple(path for path in (config.style, config.vgg_weights) if path is not None)
    check_output(output, SCENE_SUFFIXES, inputs=(*input_files(scene, paint), *extras))
    if folder is not None:
        outputs = report.plan_outputs(
            Path(folder), (*input_files(scene, paint), *extras), wants_plot=wants_plot
        )
    check_libraries(config)
    if config.style is not None and paint.palette is None:
        paint = replace(paint, palette=PaletteConfig(config.style))
    prepared = prepare(
        scene,
        paint,
        report,
        needs_view=False,
        needs_background=False,
        needs_first_view=True,
        keeps_scene=True,
    )
    strokes, gaussians, view = prepared.strokes, prepared.whole_scene, prepared.known_view

    from brushgs.refine.fit import Drawing, FitSchedule

    drawing = Drawing.of(prepared.texture, prepared.options)
    if prepared.palette is not None and paint.palette is not None:
        from brushgs.passes.recolor import recolor

        gaussians = recolor(gaussians, prepared.palette, paint.palette.strength)
    name = name_of(scene, prepared.notes)
    fit = describe_fit(scene, paint, config, prepared, gaussians, up_text(view.up))
    with _resumable(Checkpoint(checkpoint_of(output), fit), config, report) as checkpoint:
        training_views, validation_views = _target_views(gaussians, view, config, report)
        schedule = FitSchedule(config.most_steps, seed=config.seed, checkpoint=checkpoint)
        refined = refine_strokes(strokes, training_views, validation_views, drawing, schedule, config, report)
        report.settings = _settings(scene, paint, config, view)
        # First: a plot that fails must not lose it.
        write_scene(
            refined,
            output,
            report,
            is_strokes=True,
            scene=name,
            first_view=view,
            brushes=prepared.kit.images,
        )
        checkpoint.remove()
    if outputs is not None:
        title = f"{name}, {len(strokes):,} strokes of {prepared.texture.name}, {config.params}"
        camera = framed_camera(view, ViewConfig(size=config.size))
        shown, result = _Shown(gaussians, strokes, refined, camera), report.result
        report.write(
            outputs,
            lambda path: write_plot(result, _pictures(shown, drawing), path, title),
            stage="report",
        )
    return report


def refine_strokes(
    strokes: Gaussians,
    training_views: "Sequence[TargetView]",
    validation_views: "Sequence[TargetView]",
    drawing: "Drawing",
    schedule: "FitSchedule",
    config: RefineConfig,
    report: RefineReport,
) -> Gaussians:
    """Refine strokes toward the plain picture, or toward a style image, as one stage of a report.

    The figures become `report.result`.
    """
    from brushgs.refine.distil import distil, mean_psnr
    from brushgs.refine.select import select_strokes
    from brushgs.refine.variables import Variables

    with report.stage("refine", total=schedule.steps, unit="steps") as stage:
        moves = select_strokes(config.where, strokes)
        variables = Variables(strokes, config.params, moves)
        before = mean_psnr(strokes, validation_views, drawing)
        resumed_from = None if schedule.checkpoint is None else schedule.checkpoint.step

        def on_step(score: float) -> None:
            report.advance(f"{score:.2f} dB")

        if config.style is None:
            refined, curve = distil(variables, training_views, validation_views, drawing, schedule, on_step)
        else:
            from brushgs.refine.style import RATES, style_of, stylise

            painting = read_image(config.style)
            style = style_of(painting, config.vgg_weights, schedule.seed)
            refined, curve = stylise(
                variables,
                training_views,
                validation_views,
                style,
                painting,
                drawing,
                replace(schedule, rates=RATES),
                on_step=on_step,
            )
        after = mean_psnr(refined, validation_views, drawing)
        stage.did = (
            f"{int(moves.sum()):,} strokes, {config.params}: {before:.2f} to {after:.2f} dB to the plain "
            f"picture in {len(validation_views)} other views; {curve.stopped}"
        )
        if resumed_from is not None:
            stage.did += f"; resumed from step {resumed_from:,}"
        if config.style is not None:
            decrease = 1 - 10 ** (-(max(curve.scores) - curve.scores[0]) / 10)
            stage.did += f"; the loss to {config.style.name} fell by {decrease:.0%}"
        report.result = Refinement(
            config.params,
            len(strokes),
            int(moves.sum()),
            before,
            after,
            curve.stopped,
            config.style is not None,
            tuple(curve.steps),
            tuple(curve.seconds),
            tuple(curve.losses),
            tuple(curve.scores),
        )
        figures = report.result.as_dict()
        stage.counts = {
            name: figures[name] for name in ("params", "moved", "psnr_before", "psnr_after", "stopped")
        }
        stage.counts |= {f"curve_{name}": figures[name] for name in ("steps", "seconds", "losses", "scores")}
        if not moves.all():
            stage.skipped.append(f"{int((~moves).sum()):,} strokes outside {config.where}: not touched")
    return refined


def check_libraries(config: RefineConfig) -> None:
    """Refuse to refine without PyTorch, or toward a style image without kornia, before any work.

    Raises:
        ValueError: if one is not installed; VGG weights take the place of kornia.
    """
    if importlib.util.find_spec("torch") is None:
        raise ValueError("refine needs PyTorch, which is not installed; pip install torch")
    needs_kornia = config.style is not None and config.vgg_weights is None
    if needs_kornia and importlib.util.find_spec("kornia") is None:
        raise ValueError("refine --style needs kornia, which is not installed; pip install kornia")


def checkpoint_of(output: Path) -> Path:
    """The file from which a stopped run that writes `output` resumes."""
    return output.with_name(f"{output.stem}.checkpoint")


@contextmanager
def _resumable(checkpoint: Checkpoint, config: RefineConfig, report: RefineReport) -> Iterator[Checkpoint]:
    """The checkpoint of a run, read if it is resumed; a run that ends early says how to resume it.

    Raises:
        SceneError: if it cannot be read, or is that of another fit.
        KeyboardInterrupt: if the run is stopped.
    """
    path = checkpoint.path
    if config.is_resumed and path.exists():
        checkpoint.read()
    elif config.is_resumed:
        report.tell(f"--resume found no checkpoint {path}; the fit starts at its first step")
    elif path.exists():
        report.tell(
            f"{path} is left of a run that was stopped; this run starts anew and replaces it "
            "(--resume would continue from it)"
        )
    try:
        yield checkpoint
    except KeyboardInterrupt:
        raise KeyboardInterrupt(checkpoint.advice) from None
    except Exception:  # a full disk: what was fitted is not lost
        if checkpoint.step is not None:
            report.tell(checkpoint.advice)
        raise


@dataclass(frozen=True)
class _Shown:
    """What the pictures of a report show, and from where."""

    scene: Gaussians
    before: Gaussians
    after: Gaussians
    camera: Camera


def _pictures(shown: _Shown, drawing: "Drawing") -> dict[str, Array]:
    """The strokes before and after, and the plain picture, from one camera."""
    from brushgs.refine.distil import BACKGROUND, TargetView

    plain = TargetView.of(shown.scene, shown.camera).over(BACKGROUND)
    return {
        name: drawing.frame(strokes, shown.camera).over(BACKGROUND)
        for name, strokes in (("before", shown.before), ("after", shown.after))
    } | {"plain": plain.numpy()}


def _settings(scene: SceneFiles, paint: PaintConfig, config: RefineConfig, view: FirstView) -> dict[str, Any]:
    """All that a reader needs to repeat the figures."""
    return plain_paint(scene, replace(paint, view=ViewConfig(up=up_text(view.up)))) | {
        "refine": plain_config(config),
        "validation_views": NUM_VALIDATION_VIEWS,
    }


def _target_views(
    gaussians: Gaussians, first_view: FirstView, config: RefineConfig, report: Report
) -> "tuple[list[TargetView], list[TargetView]]":
    """Training and validation views, with the plain picture as target."""
    with report.stage("views") as stage:
        from brushgs.refine.distil import TargetView
        from brushgs.refine.views import views_around

        width, height = config.size
        affordable = max(STYLE_VIEWS, min(SELF_VIEWS, int(MOST_BYTES // (16 * width * height))))
        num_views = config.views or (affordable if config.style is None else STYLE_VIEWS)
        training_views, validation_views = (
            [
                TargetView.of(gaussians, view)
                for view in views_around(first_view, num, width=width, height=height, shift=shift)
            ]
            for num, shift in ((num_views, 0.0), (NUM_VALIDATION_VIEWS, 0.5))
        )
        stage.did = f"{num_views} for training, {NUM_VALIDATION_VIEWS} for validation, {width}x{height}"
        stage.counts = {
            "views": num_views,
            "validation_views": NUM_VALIDATION_VIEWS,
            "width": width,
            "height": height,
        }
    return training_views, validation_views
