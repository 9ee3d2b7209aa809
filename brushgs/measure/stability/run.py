"""`brushgs stability`: figures of flicker of a scene file along a path, as table, JSON and plot."""

from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from brushgs.measure.plotting import BLUE, GREEN, GREY, PURPLE, SKY, VERMILION, label, new_figure, save_figure
from brushgs.measure.report import (
    ExperimentReport,
    check_opaque_background,
    plain_camera,
    plain_config,
    plain_paint,
)
from brushgs.measure.stability.figures import SCHEMA, Stability
from brushgs.measure.stability.look_painters import behind, is_bare, main_coat
from brushgs.measure.stability.measure import (
    NO_FLOW,
    TWO_MOMENTS,
    check_cameras,
    measure_stability,
    num_painted_frames,
)
from brushgs.measure.stability.painters import Comparison, MakePainters, no_painters
from brushgs.options.experiments import StabilityConfig
from brushgs.options.painting import CleanConfig, PaintConfig
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.options.sequence import PathConfig
from brushgs.pipeline.backdrop import for_film
from brushgs.pipeline.clip import Clip
from brushgs.pipeline.hand import open_hand
from brushgs.pipeline.outputs import input_files
from brushgs.pipeline.prepare import PICTURE, STROKES, prepare
from brushgs.pipeline.report import Report
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.moving import MovingScene

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.console import Console

    from brushgs.passes.motion.estimate import EstimatedMotion
    from brushgs.pipeline.prepare import Prepared


IN_MEMORY = "a moving scene in memory"  # in place of its files


@dataclass
class StabilityReport(ExperimentReport):
    """The stages of a measurement and its figures: `result` is a `Stability`."""

    name: ClassVar[str] = "stability"
    schema: ClassVar[int] = SCHEMA

    def print_figures(self, console: "Console") -> None:
        """Print one column per configuration, and the advice."""
        from brushgs.measure.stability.table import stability_table

        console.print(stability_table(self.result), markup=False)
        console.print(self.result.advice, markup=False, soft_wrap=True)


def report_stability(
    scene: SceneFiles | Clip,
    output: str | Path,
    paint: PaintConfig,
    path: PathConfig | None,
    config: StabilityConfig | None = None,
    *,
    make_extra_painters: MakePainters = no_painters,
    report: StabilityReport | None = None,
    wants_plot: bool = True,
    truth: "MovingScene | None" = None,
) -> StabilityReport:
    """Measure how stable the strokes of a scene are along a path, and write the figures.

    Args:
        scene: the files of a trained 3D Gaussian scene, or a moving scene.
        output: a folder, which gets `stability.json` and `stability.png` and is created if missing; or one
            file that ends in .json or .png.
        paint: all options; its lock is ignored, every lock is painted.
        path: the path of the camera; None for a fixed camera and a moving scene.
        config: of the measurement.
        make_extra_painters: see `measure_stability`.
        report: collects the stages; None makes a new one.
        wants_plot: whether a folder gets the plot, if matplotlib is installed.
        truth: the same moving scene with corresponding rows, for the plain pictures and the flow, if rows of
            `scene` do not correspond; None then estimates its motion, see `EstimatedMotion`.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if an option does not suit the scene; before long work if possible.
    """
    config, report, output = config or StabilityConfig(), report or StabilityReport(), Path(output)
    clip = scene if isinstance(scene, Clip) else None
    files: SceneFiles = (scene.source or IN_MEMORY) if isinstance(scene, Clip) else scene
    outputs = report.plan_outputs(output, input_files(files, paint), wants_plot=wants_plot)
    check_opaque_background(paint.draw.background)
    if clip is not None:
        _check_clip(clip, has_truth=truth is not None)
    paint_anyhow = replace(paint, draw=replace(paint.draw, lock=None))
    prepared = prepare(
        scene,
        paint_anyhow,
        report,
        asks=(*PICTURE, "scene"),
        views=path,
        check_path=lambda planned: check_cameras(planned.closed if clip is None else planned.cameras),
    )
    comparison = _compared(prepared, paint_anyhow, clip, truth, has_alone=not config.skip_alone)
    planned = prepared.path
    assert planned is not None
    of_path = {} if path is None else plain_config(path)
    report.settings = plain_paint(files, paint) | {
        "path": of_path | {"source": planned.source},
        "clip": None if clip is None else plain_config(clip.config),
        "measure": plain_config(config),
        "first_camera": plain_camera(planned.cameras[0]),
        "last_camera": plain_camera(planned.cameras[-1]),
    }
    report.result = result = _measure(comparison, len(planned.cameras), config, make_extra_painters, report)
    report.output = str(output)
    strokes = f"{len(comparison.strokes):,} strokes of {comparison.texture.name}"
    title = f"{SceneSource.of(files).name}, {strokes}, {planned.source}"
    report.write(outputs, lambda file: write_plot(result, file, title))
    return report


def _check_clip(clip: Clip, *, has_truth: bool) -> None:
    if not has_truth and not clip.scene.has_rows and clip.file_times() is None:
        raise ValueError(NO_FLOW)
    if clip.config.cross_fade is not None:
        raise ValueError(TWO_MOMENTS)


def _compared(
    prepared: "Prepared", paint: PaintConfig, clip: Clip | None, truth: MovingScene | None, *, has_alone: bool
) -> Comparison:
    """The scene, and its strokes or the whole painting of a look; with `alone` if that is compared."""
    planned, moving, whole = prepared.path, prepared.moving, prepared.whole_scene
    assert planned is not None
    assert prepared.background is not None
    known: MovingScene | EstimatedMotion | None = truth
    if moving is not None and truth is None:
        known = moving.scene if moving.scene.has_rows else _estimated(prepared)
    elif clip is not None and not clip.scene.has_rows:
        whole = replace(whole, ids=None)  # ids are not rows of the truth

    painting = None if is_bare(prepared.painting) else for_film(prepared.painting, paint, planned.cameras)
    hand = open_hand(paint, planned, prepared.painting.coats)

    def remake(gaussians: Gaussians, camera: Camera) -> "Prepared":
        alone = replace(paint, clean=CleanConfig("off"))
        return prepare(
            gaussians, alone, Report(), views=camera, asks=STROKES if painting is None else PICTURE
        )

    comparison = Comparison(
        whole,
        prepared.strokes,
        planned.closed if moving is None else planned.cameras,
        prepared.texture,
        prepared.options,
        prepared.background,
        fps=planned.fps,
        moving=moving,
        truth=known,
        is_loop=planned.is_loop,
        remake=remake if has_alone else None,
        painting=painting,
        by_hand=None if hand is None else (hand, prepared.painting),
    )
    if painting is None:
        return comparison
    coat, ground = main_coat(painting), behind(painting)
    comparison = replace(comparison, strokes=coat.strokes, texture=coat.texture, options=coat.options)
    return comparison if ground is None else replace(comparison, background=ground)


def _estimated(prepared: "Prepared") -> "EstimatedMotion":
    """The estimated motion of a clip whose rows do not correspond."""
    from brushgs.passes.motion.estimate import EstimatedMotion

    assert prepared.moving is not None, "of a clip"
    scene = prepared.moving.scene
    assert scene.times is not None, "it has moments"
    return EstimatedMotion(scene, scene.times)


def _measure(
    comparison: Comparison,
    num_frames: int,  # of the path; the comparison repeats the first of a loop at its end
    config: StabilityConfig,
    make_extra_painters: MakePainters,
    report: Report,
) -> Stability:
    num_repeated = len(comparison.cameras) - num_frames
    num_painted = num_painted_frames(comparison, config) - num_repeated
    calls = count()

    def advance() -> None:
        if next(calls) >= num_repeated:  # a repeated frame counts once
            report.advance()

    with report.stage("measure", total=num_painted) as stage:
        result = measure_stability(
            comparison, config, make_extra_painters=make_extra_painters, advance=advance
        )
        num_pairs = len(result.starts)
        stage.did = (
            f"{num_painted} frames in {len(result.configurations)} configurations, {num_pairs} pairs per gap"
        )
        stage.counts = {"frames": num_painted, "pairs": num_pairs, "stride": result.stride}
        if comparison.painting is not None:
            stage.skipped.append("published: no figures of whole paintings in a look were published")
        if comparison.truth is not None and not isinstance(comparison.truth, MovingScene):
            stage.details.append("rows of the moments differ: the motion of the scene is estimated")
        if num_skipped := num_frames - num_painted:
            stage.skipped.append(f"painting {num_skipped} frames: no pair needs them (--pairs)")
    return result


# The temporal report as a plot: error along the path, excess by gap.


COLORS = {
    "track": BLUE,
    "anchor": SKY,
    "off": GREEN,
    "published": VERMILION,
    "alone": VERMILION,  # no path has both
    "plain": GREY,
}
EXTRA_COLOR = PURPLE  # of a configuration that the report does not have by itself
WIDTH, HEIGHT = 9.0, 3.4  # inches


def write_plot(result: Stability, path: Path, title: str) -> None:
    """Draw the plot to a PNG, written atomically.

    Raises:
        ValueError: if matplotlib is not installed.
        SceneError: if the file cannot be written.
    """
    figure = new_figure(WIDTH, HEIGHT, title)
    along, by_gap = figure.subplots(1, 2, width_ratios=(1.6, 1))
    _draw_errors(along, result)
    _draw_excess(by_gap, result)
    save_figure(figure, path)


def _draw_errors(axes: "Axes", result: Stability) -> None:
    """RMSE at gap 1 along the path, one line per configuration."""
    for figures in result.configurations:
        style = "--" if figures.name == "plain" else "-"
        errors = [255 * error for error in figures.errors]
        axes.plot(
            list(result.starts),
            errors,
            style,
            color=COLORS.get(figures.name, EXTRA_COLOR),
            linewidth=1.3,
            zorder=4 if figures.name == "track" else 3,  # on top where lines coincide
            label=figures.name,
            marker="." if len(errors) < 3 else None,
        )
    label(axes, "frame", "error at gap 1 (RMSE, of 255)", "Along the path")
    axes.set_xlim(0, result.num_frames - 1)
    axes.legend(fontsize=7, ncols=3, frameon=False, loc="upper left")
    axes.set_ylim(0, 1.28 * axes.get_ylim()[1])  # room for the legend


def _draw_excess(axes: "Axes", result: Stability) -> None:
    """Mean excess at each gap, one labeled bar per configuration."""
    shown = [figures for figures in result.configurations if figures.name != "plain"]
    width = 0.8 / len(shown)
    gaps = [warp.gap for warp in shown[0].warps]
    for number, figures in enumerate(shown):
        places = [i + (number - (len(shown) - 1) / 2) * width for i in range(len(gaps))]
        heights = [255 * warp.excess for warp in figures.warps]
        bars = axes.bar(places, heights, width * 0.92, color=COLORS.get(figures.name, EXTRA_COLOR))
        axes.bar_label(bars, fmt="%.1f", fontsize=6, padding=1)
    label(axes, "gap (frames)", "excess over the plain picture (of 255)", "Mean over the path")
    axes.set_xticks(range(len(gaps)), [str(gap) for gap in gaps])
    axes.axhline(0, color="black", linewidth=0.6)
