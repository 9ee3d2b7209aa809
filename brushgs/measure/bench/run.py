"""`brushgs bench`: a scene file becomes curves of error against run time: table, JSON, CSV and plot."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from brushgs.measure.bench.figures import SCHEMA
from brushgs.measure.bench.machine import describe_machine
from brushgs.measure.bench.measure import measure
from brushgs.measure.bench.plot import write_plot
from brushgs.measure.bench.subject import Subject
from brushgs.measure.report import ExperimentReport, Outputs, plain_camera, plain_config
from brushgs.options.experiments import BenchConfig
from brushgs.options.painting import PaintConfig
from brushgs.painting.background import check_background
from brushgs.painting.outputs import input_files
from brushgs.painting.prepare import prepare

if TYPE_CHECKING:
    from rich.console import Console


@dataclass
class BenchReport(ExperimentReport):
    """A run, and what it found: `result` is a `Bench`."""

    name: ClassVar[str] = "bench"
    schema: ClassVar[int] = SCHEMA

    def print_figures(self, console: "Console") -> None:
        """One row per point, and the advice."""
        from brushgs.measure.bench.table import print_bench

        print_bench(self.result, console)


def report_bench(
    scene: str | Path,
    output: str | Path,
    paint: PaintConfig,
    config: BenchConfig | None = None,
    *,
    report: BenchReport | None = None,
    wants_plot: bool = True,
) -> BenchReport:
    """Draw the curves of error against run time of a scene.

    Args:
        scene: a trained 3D Gaussian scene.
        output: a folder, which gets `bench.json`, `bench.csv` and `bench.png` and is made if missing; or one
            file that ends in .json, .csv or .png.
        paint: pruning, clustering, view and stroke; its count of strokes is not looked at.
        config: what is measured.
        report: where the stages are told; a new one if None.
        wants_plot: whether a folder gets the plot, which needs matplotlib.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if an option does not suit the scene, before any long work where that can be known.
        WrongPictureError: if a picture is not what it should be.
    """
    config, report, output = config or BenchConfig(), report or BenchReport(), Path(output)
    outputs = Outputs.of(output, report.name, wants_plot=wants_plot)
    outputs.check(input_files(scene, paint))
    check_background(paint.draw.background)
    if paint.draw.background == "transparent":
        raise ValueError("background must be a colour or an image to compare pictures on, got transparent")
    machine = describe_machine(paint.draw.threads)
    kept = replace(paint, cluster=replace(paint.cluster, strokes=None))  # the families cluster by themselves
    prepared = prepare(scene, kept, report, keeps_scene=True)
    subject = Subject(Path(scene), prepared, paint, config)
    report.settings = _settings(subject, machine)
    report.result = measure(subject, report)
    _write(outputs, report, subject)
    report.output = str(output)
    outputs.write_text(".json", report.as_json() + "\n")
    return report


def _settings(subject: Subject, machine: dict[str, Any]) -> dict[str, Any]:
    """All that a reader needs to repeat the figures."""
    paint = subject.paint
    return {
        "scene": str(subject.path),
        "prune": plain_config(paint.prune),
        "cluster": plain_config(paint.cluster),
        "draw": plain_config(paint.draw),
        "view": plain_config(paint.view),
        "measure": plain_config(subject.config),
        "camera": plain_camera(subject.camera),
        "machine": machine,
    }


def _write(outputs: Outputs, report: BenchReport, subject: Subject) -> None:
    """The folder, if one is asked for, the CSV and the plot; the JSON tells of this too and comes last."""
    with report.stage("write") as stage:
        outputs.make_folder()
        outputs.write_text(".csv", report.result.as_csv())
        if outputs.plot is not None:
            write_plot(report.result, outputs.plot, _title(subject, report.settings["machine"]["threads"]))
        written = [str(path) for path in outputs.paths.values()]
        stage.did = " and ".join(written)
        stage.counts = {"paths": written}
        if outputs.plot is None:
            stage.skipped.append("plot: not asked for")


def _title(subject: Subject, num_threads: int) -> str:
    name = subject.path.stem.removesuffix(".compressed")
    size = f"{subject.camera.width}x{subject.camera.height}"
    what = f"{name}, {len(subject.gaussians):,} Gaussians, {subject.texture.name}, {size}"
    return f"{what}, {num_threads} threads; filled: on the Pareto front"
