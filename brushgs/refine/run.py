"""`brushgs refine`: make strokes of a scene file, refine them, and write them as a scene file.

stroke (-> palette) -> load -> prune -> cluster (-> recolor) (-> follow) -> views -> refine -> write

For a moving scene, views are at several moments. Strokes change only at their reference moments; their motion
stays. They are written as one scene file per moment.
"""

import importlib.util
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from brushgs.cameras.first_view import framed_camera, up_text
from brushgs.formats.registry import SCENE_SUFFIXES
from brushgs.measure.report import plain_config, plain_paint
from brushgs.options.experiments import RefineConfig
from brushgs.options.painting import PaintConfig, PaletteConfig, ViewConfig
from brushgs.options.scene_source import SceneFiles
from brushgs.options.styling import StyleConfig
from brushgs.pipeline.clip import Clip, as_files, files_of
from brushgs.pipeline.moments import check_strokes_output, write_strokes
from brushgs.pipeline.outputs import input_files
from brushgs.pipeline.prepare import STROKES, Prepared, prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.strokes import name_of, open_palette, recolor_scene
from brushgs.pipeline.where import rows_where
from brushgs.refine.checkpoint import Checkpoint, describe_fit
from brushgs.refine.mix_styles import open_styles
from brushgs.refine.painting_style import PaintingStyle, is_style
from brushgs.refine.report import RefineReport, write_plot
from brushgs.values.arrays import Array, Mask
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.refine.fit import Drawing
    from brushgs.refine.targets import TargetView

NUM_VALIDATION_VIEWS = 6
# Training views. A picture of the scene takes milliseconds, and strokes overfit to few views.
SELF_VIEWS, STYLE_VIEWS = 320, 24
MOST_BYTES = 6e8  # limit for target pictures: larger pictures mean fewer views, unless a number is given


def refine_file(
    scene: SceneFiles | Clip,
    output: str | Path,
    paint: PaintConfig | None = None,
    config: RefineConfig | None = None,
    *,
    report: RefineReport | None = None,
    folder: str | Path | None = None,
    wants_plot: bool = True,
) -> RefineReport:
    """Refine the strokes of a scene; write them as a scene file, for a moving scene as one per moment.

    Args:
        scene: the files of a trained 3D Gaussian scene, or of a moving scene.
        output: scene file (.ply) to write; for a moving scene a folder, see
            `check_strokes_output`.
        paint: options of the painting; of its view only `up` is used.
        config: see `RefineConfig`. The checkpoint beside the output is resumed, see `checkpoint_of`; without
            one the fit starts anew, with a note.
        report: collects stages and figures; None makes a new one.
        folder: for `refine.json` and `refine.png` (the curve, and pictures before and after), made if
            missing; or one .json or .png file; or None.
        wants_plot: whether a folder gets the plot, if matplotlib is installed.

    Returns:
        The report, one stage per step.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if an option does not suit the scene, or PyTorch or kornia is missing.
        KeyboardInterrupt: if the run is stopped; says how to resume it.
    """
    paint, config, report = paint or PaintConfig(), config or RefineConfig(), report or RefineReport()
    files, scene, outputs = files_of(scene), as_files(scene), None
    inputs = _inputs(files, paint, config)
    check_strokes_output(scene, output, inputs)
    output = Path(output)
    if folder is not None:
        outputs = report.plan_outputs(Path(folder), inputs, wants_plot=wants_plot)
    check_libraries(config)
    from brushgs.refine.rates import rates_of_rows, with_weights

    config = with_weights(config, report)
    learned = None
    if config.style is not None:
        learned = _open_style(config.style, report)
        if paint.palette is None:
            paint = replace(paint, palette=_palette_of(config.style, learned, output))
    prepared = prepare(
        scene,
        paint if config.where is None else replace(paint, palette=None),  # applies to that part only
        report,
        asks=(*STROKES, "first_view", "scene"),
    )
    gaussians, view = prepared.whole_scene, prepared.known_view
    moves = rows_where(prepared.strokes, config.where, view, report, what="strokes")
    if paint.palette is not None:
        prepared, gaussians = _recolored(prepared, moves, paint.palette, config, report)
    name = name_of(files, prepared.notes)
    shown_at = _shown_over_time(prepared, gaussians, paint)
    prepared, moves, is_laid = _in_style(prepared, moves, learned, shown_at, paint, config, output, report)
    from brushgs.refine.fit import FitSchedule
    from brushgs.refine.refine_strokes import StyleTarget, refine_strokes
    from brushgs.refine.variables import Variables

    strokes, drawing = prepared.strokes, _drawing(prepared)
    target = None if learned is None else StyleTarget(learned.painting, is_laid)
    fit = describe_fit(scene, paint, config, prepared, gaussians, up_text(view.up))
    with _resumable(Checkpoint(checkpoint_of(output), fit), config, report) as checkpoint:
        views = _target_views(prepared, shown_at, config, report)
        schedule = FitSchedule(config.most_steps, seed=config.seed, checkpoint=checkpoint)
        shares = rates_of_rows(strokes, view, config, report)
        variables = Variables(strokes, config.params, moves, shares)
        refined = refine_strokes(variables, views, drawing, schedule, config, report, target)
        report.settings = _settings(scene, paint, config, view)
        # before the plot: if that fails, the strokes are not lost
        write_strokes(refined, prepared, output, name, report)
        checkpoint.remove()
    if outputs is not None:
        title = f"{name}, {len(strokes):,} strokes of {prepared.texture.name}, {config.params}"
        camera = framed_camera(view, ViewConfig(size=config.size))
        moment = None if prepared.moving is None else len(prepared.moving.motion.times) // 2
        shown = _Shown(shown_at(moment), strokes, refined, camera, moment, drawing)
        result = report.result
        report.write(outputs, lambda path: write_plot(result, shown.pictures(), path, title), stage="report")
    return report


def _inputs(files: SceneFiles | None, paint: PaintConfig, config: RefineConfig) -> tuple[Path, ...]:
    """All input files."""
    extras = [] if config.weights is None else [config.weights]
    extras += () if config.style is None else config.style.files
    parts = (*(() if config.where is None else (config.where,)), *config.rated_regions)
    extras += [file for part in parts for file in part.files]
    return (*input_files(files, paint), *extras)


def _drawing(prepared: Prepared) -> "Drawing":
    from brushgs.refine.fit import Drawing

    moving = prepared.moving
    motion, takes_light = (None, True) if moving is None else (moving.motion, moving.takes_light)
    return Drawing.of(prepared.texture, prepared.options, motion, takes_light=takes_light)


def _palette_of(style: StyleConfig, learned: PaintingStyle, output: Path) -> PaletteConfig:
    """The colors of styles in their shares; those of several are written beside the output."""
    strength = sum(one.share * one.color for one in style.styles)
    if len(style.files) == 1:
        return PaletteConfig(style.files[0], strength)
    from brushgs.formats.styles import write_style
    from brushgs.refine.in_style import style_beside

    write_style(learned.style, style_beside(output))
    return PaletteConfig(style_beside(output), strength)


def _open_style(style: StyleConfig, report: Report) -> PaintingStyle:
    """The style of a painting, or the mix of several, as one stage."""
    with report.stage("style") as stage:
        learned, path = open_styles(style), style.only or style
        marks, height, width = learned.style.marks, *learned.painting.shape[:2]
        is_picture = isinstance(path, Path) and not is_style(path)
        stage.did = f"{path}, {width}x{height} pixels" if is_picture else f"{path}"
        if marks is None:
            stage.skipped.append("marks: the style has none; strokes keep their own and take its colors")
        else:
            stage.did += (
                f": marks {marks.length:.1%} of its shorter side long, {marks.aspect:.1f} times as long as "
                f"wide, {len(marks.brushes)} brushes"
            )
        stage.counts = {"path": str(path), "brushes": 0 if marks is None else len(marks.brushes)}
    return learned


def _recolored(
    prepared: Prepared, moves: Mask | None, palette: PaletteConfig, config: RefineConfig, report: Report
) -> tuple[Prepared, Gaussians]:
    """Strokes (those that may change) in the colors of a palette, and the target scene."""
    from brushgs.passes.color.recolor import recolor

    gaussians, inside = prepared.whole_scene, None
    if moves is not None:
        opened, shares = open_palette(palette, report), moves.astype(np.float64)
        strokes = recolor_scene(prepared.strokes, opened, palette, report, shares=shares)
        prepared = replace(prepared, strokes=strokes, palette=opened)
        rows = rows_where(gaussians, config.where, prepared.known_view, Report())
        inside = None if rows is None else rows.astype(np.float64)
    assert prepared.palette is not None, "it was opened"
    return prepared, recolor(gaussians, prepared.palette, palette.strength, shares=inside)


def _in_style(
    prepared: Prepared,
    moves: Mask | None,
    learned: PaintingStyle | None,
    shown_at: Callable[[int | None], Gaussians],
    paint: PaintConfig,
    config: RefineConfig,
    output: Path,
    report: RefineReport,
) -> tuple[Prepared, Mask | None, bool]:
    """The painting with the marks of the style, a mask of those that may change, and whether there are any.

    Also writes the style file beside the output.
    """
    marks = None if learned is None or config.params == "color" else learned.style.marks
    if learned is None or marks is None or prepared.texture.kind != "image":
        return prepared, moves, False
    from brushgs.refine.in_style import Laid, lay_in_style, style_beside

    most = paint.cluster.strokes if isinstance(paint.cluster.strokes, int) else None
    inside = np.ones(len(prepared.strokes), bool) if moves is None else moves
    painted = Laid(prepared, inside)
    laid = lay_in_style(painted, marks, shown_at, paint, config.keeps, output, report, most=most)
    beside = style_beside(output)
    files = () if config.style is None else config.style.files
    is_input = beside.exists() and any(beside.samefile(file) for file in files)
    if marks.brushes and not is_input:
        from brushgs.formats.styles import write_style

        write_style(learned.style, beside)
    return laid.prepared, None if moves is None else laid.moves, True


def check_libraries(config: RefineConfig) -> None:
    """Refuse to refine without PyTorch, or toward a style image without kornia, before any work.

    Raises:
        ValueError: if one is not installed; with VGG weights kornia is not needed.
    """
    if importlib.util.find_spec("torch") is None:
        raise ValueError("refine needs PyTorch, which is not installed; pip install torch")
    needs_kornia = config.style is not None and config.weights is None
    if needs_kornia and importlib.util.find_spec("kornia") is None:
        raise ValueError("refine --style needs kornia, which is not installed; pip install kornia")


def checkpoint_of(output: Path) -> Path:
    """The checkpoint file of a run that writes `output`, a file or folder."""
    name = output.stem if output.suffix.lower() in SCENE_SUFFIXES else output.name
    return output.with_name(f"{name}.checkpoint")


@contextmanager
def _resumable(checkpoint: Checkpoint, config: RefineConfig, report: RefineReport) -> Iterator[Checkpoint]:
    """The checkpoint of a run, read if resumed; a stopped run tells how to resume.

    Raises:
        SceneError: if it cannot be read, or belongs to another fit.
        KeyboardInterrupt: if the run is stopped.
    """
    path = checkpoint.path
    if config.is_resumed and path.exists():
        checkpoint.read()
    elif config.is_resumed:
        report.tell(f"--resume found no checkpoint {path}; the fit starts at its first step")
    elif path.exists():
        report.tell(
            f"{path} is left over from a stopped run; this run starts anew and replaces it "
            "(--resume would continue from it)"
        )
    try:
        yield checkpoint
    except KeyboardInterrupt:
        raise KeyboardInterrupt(checkpoint.advice) from None
    except Exception:  # such as a full disk: keep the fit
        if checkpoint.step is not None:
            report.tell(checkpoint.advice)
        raise


@dataclass(frozen=True)
class _Shown:
    """Contents and camera of the report's pictures."""

    scene: Gaussians
    before: Gaussians
    after: Gaussians
    camera: Camera
    moment: int | None  # of a clip
    drawing: "Drawing"

    def pictures(self) -> dict[str, Array]:
        """The strokes before and after, and the plain picture, from one camera."""
        from brushgs.refine.distil import BACKGROUND
        from brushgs.refine.targets import TargetView

        plain = TargetView.of(self.scene, self.camera).over(BACKGROUND)
        return {
            name: self.drawing.frame(strokes, self.camera, self.moment).over(BACKGROUND)
            for name, strokes in (("before", self.before), ("after", self.after))
        } | {"plain": plain.numpy()}


def _settings(
    scene: SceneFiles | Clip, paint: PaintConfig, config: RefineConfig, view: FirstView
) -> dict[str, Any]:
    """All settings needed to reproduce the figures."""
    settings = plain_paint(files_of(scene), replace(paint, view=ViewConfig(up=up_text(view.up)))) | {
        "refine": plain_config(config),
        "validation_views": NUM_VALIDATION_VIEWS,
    }
    return settings | ({"clip": plain_config(scene.config)} if isinstance(scene, Clip) else {})


def _shown_over_time(
    prepared: Prepared, recolored: Gaussians, paint: PaintConfig
) -> Callable[[int | None], Gaussians]:
    """The target scene at a moment of a clip; None for a still one."""
    moving = prepared.moving
    if moving is None:
        return lambda moment: recolored
    from brushgs.refine.targets import scene_over_time

    strength = 1.0 if paint.palette is None else paint.palette.strength
    at = scene_over_time(moving, prepared.whole_scene, prepared.palette, strength)
    return lambda moment: at(moment or 0)


def _target_views(
    prepared: Prepared, shown_at: Callable[[int | None], Gaussians], config: RefineConfig, report: Report
) -> "tuple[list[TargetView], list[TargetView]]":
    """Training and validation views, with the plain picture as target."""
    view, moving, (width, height) = prepared.known_view, prepared.moving, config.size
    with report.stage("views") as stage:
        from brushgs.refine.targets import draw_targets
        from brushgs.refine.views import TimedView, views_around, views_over_time

        affordable = max(STYLE_VIEWS, min(SELF_VIEWS, int(MOST_BYTES // (16 * width * height))))
        num_views = config.views or (affordable if config.style is None else STYLE_VIEWS)
        num_moments = 0 if moving is None else len(moving.motion.times)
        size, found = {"width": width, "height": height}, []
        for num, shift in ((num_views, 0.0), (NUM_VALIDATION_VIEWS, 0.5)):
            if moving is None:
                views = [TimedView(camera) for camera in views_around(view, num, **size, shift=shift)]
            else:
                own = framed_camera(view, ViewConfig(size=config.size)) if shift == 0 else None
                views = views_over_time(view, num, num_moments, **size, own=own, shift=shift)
            found.append(draw_targets(views, shown_at, prepared.options.num_threads))
        stage.did = f"{num_views} for training, {NUM_VALIDATION_VIEWS} for validation, {width}x{height}"
        stage.counts = {"views": num_views, "validation_views": NUM_VALIDATION_VIEWS} | size
        if moving is not None:
            stage.did += f", over {num_moments:,} moments"
            stage.counts["moments"] = num_moments
    return found[0], found[1]
