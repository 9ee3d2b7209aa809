"""`brushgs stability`: a scene file becomes a table, a JSON file and a plot."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from brushgs.cameras.paths import CameraPath
from brushgs.measure.report import (
    ExperimentReport,
    check_opaque_background,
    plain_camera,
    plain_config,
    plain_paint,
)
from brushgs.measure.stability.figures import SCHEMA, Stability
from brushgs.measure.stability.measure import check_cameras, measure_stability, painted_frames
from brushgs.measure.stability.painters import Comparison
from brushgs.measure.stability.plot import write_plot
from brushgs.options.experiments import StabilityConfig
from brushgs.options.painting import PaintConfig
from brushgs.options.sequence import PathConfig
from brushgs.painting.outputs import input_files
from brushgs.painting.prepare import prepare
from brushgs.painting.report import Report

if TYPE_CHECKING:
    from rich.console import Console


@dataclass
class StabilityReport(ExperimentReport):
    """A run, and what it found: `result` is a `Stability`."""

    name: ClassVar[str] = "stability"
    schema: ClassVar[int] = SCHEMA

    def print_figures(self, console: "Console") -> None:
        """One column per configuration."""
        from brushgs.measure.stability.table import stability_table

        console.print(stability_table(self.result), markup=False)


def report_stability(
    scene: str | Path,
    output: str | Path,
    paint: PaintConfig,
    path: PathConfig,
    config: StabilityConfig | None = None,
    *,
    report: StabilityReport | None = None,
    wants_plot: bool = True,
) -> StabilityReport:
    """Measure how still the strokes of a scene hold along a path; write figures and plot.

    Args:
        scene: a trained 3D Gaussian scene.
        output: a folder, which gets `stability.json` and `stability.png` and is made if missing; or one file
            that ends in .json or .png.
        paint: pruning, strokes, view and stroke; its lock is not looked at, all are painted.
        path: the way of the camera.
        config: what is measured.
        report: where the stages are told; a new one if None.
        wants_plot: whether a folder gets the plot, which needs matplotlib.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if an option does not suit the scene, before any long work where that can be known.
    """
    config, report, output = config or StabilityConfig(), report or StabilityReport(), Path(output)
    outputs = report.plan_outputs(output, input_files(scene, paint), wants_plot=wants_plot)
    check_opaque_background(paint.draw.background)
    asked = replace(paint, draw=replace(paint.draw, lock=None))  # every lock is painted
    prepared = prepare(
        scene,
        asked,
        report,
        views=path,
        check_path=lambda way: check_cameras(way.closed),
        keeps_scene=True,
    )
    way, texture, strokes = prepared.path, prepared.texture, prepared.strokes
    assert way is not None
    assert prepared.background is not None
    comparison = Comparison(
        prepared.whole_scene,
        strokes,
        way.closed,
        texture,
        prepared.options,
        prepared.background,
        paint.cluster.seed,
    )
    report.settings = _settings(scene, paint, path, config, way)
    report.result = result = _measure(comparison, config, report)
    report.output = str(output)
    title = f"{Path(scene).stem}, {len(strokes):,} strokes of {texture.name}, {way.source}"
    report.write(outputs, lambda file: write_plot(result, file, title))
    return report


def _measure(comparison: Comparison, config: StabilityConfig, report: Report) -> Stability:
    num_painted = painted_frames(comparison.cameras, config)
    with report.stage("measure", total=num_painted) as stage:
        result = measure_stability(comparison, config, advance=report.advance)
        num_pairs = len(result.starts)
        stage.did = (
            f"{num_painted} frames in {len(result.configurations)} configurations, {num_pairs} pairs a gap"
        )
        stage.counts = {"frames": num_painted, "pairs": num_pairs, "stride": result.stride}
        num_left = len(comparison.cameras) - num_painted
        if num_left:
            stage.skipped.append(f"painting {num_left} frames: no pair needs them (--pairs)")
    return result


def _settings(
    scene: str | Path, paint: PaintConfig, path: PathConfig, config: StabilityConfig, way: CameraPath
) -> dict[str, Any]:
    """All that a reader needs to repeat the figures."""
    return plain_paint(scene, paint) | {
        "path": plain_config(path) | {"source": way.source},
        "measure": plain_config(config),
        "first_camera": plain_camera(way.cameras[0]),
        "last_camera": plain_camera(way.cameras[-1]),
    }
