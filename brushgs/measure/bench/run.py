"""`brushgs bench`: curves of error against run time of a scene file, as table, JSON, CSV and plot."""

import platform
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.measure.bench.figures import SCHEMA
from brushgs.measure.bench.look_subject import LookSubject, has_look
from brushgs.measure.bench.measure import measure, of_whole_paintings
from brushgs.measure.bench.plot import write_plot
from brushgs.measure.bench.subject import ASKS, Subject
from brushgs.measure.report import (
    ExperimentReport,
    check_opaque_background,
    plain_camera,
    plain_config,
    plain_paint,
)
from brushgs.options.experiments import BenchConfig
from brushgs.options.painting import PaintConfig
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.pipeline.outputs import input_files
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report

if TYPE_CHECKING:
    from rich.console import Console


@dataclass
class BenchReport(ExperimentReport):
    """The stages of a bench and its figures: `result` is a `Bench`."""

    name: ClassVar[str] = "bench"
    schema: ClassVar[int] = SCHEMA

    def print_figures(self, console: "Console") -> None:
        """Print one row per point, and the advice."""
        from brushgs.measure.bench.table import print_bench

        print_bench(self.result, console)


def report_bench(
    scene: SceneFiles,
    output: str | Path,
    paint: PaintConfig,
    config: BenchConfig | None = None,
    *,
    report: BenchReport | None = None,
    wants_plot: bool = True,
) -> BenchReport:
    """Measure error against run time of a scene, and write the figures.

    Args:
        scene: the files of a trained 3D Gaussian scene.
        output: a folder, which gets `bench.json`, `bench.csv` and `bench.png` and is created if missing; or
            one file that ends in .json, .csv or .png.
        paint: pruning, clustering, view and stroke; the number of strokes is ignored. Or a look: then whole
            paintings are measured, with its number of strokes except in the curve of strokes.
        config: of the bench.
        report: collects the stages; None makes a new one.
        wants_plot: whether a folder gets the plot, if matplotlib is installed.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if an option does not suit the scene; before long work if possible.
        WrongPictureError: if a picture does not agree with its definition.
    """
    config, report, output = config or BenchConfig(), report or BenchReport(), Path(output)
    outputs = report.plan_outputs(output, input_files(scene, paint), wants_plot=wants_plot)
    check_opaque_background(paint.draw.background)
    is_look = has_look(paint)
    config = replace(config, families=config.families_of(has_look=is_look))
    machine = describe_machine(paint.draw.threads)
    source, whole = SceneSource.of(scene), None
    subject: Subject | LookSubject
    if is_look:
        subject = LookSubject.open(source, paint, config, report)
        if "strokes" in config.families_of(has_look=True):
            _make_limit(subject, report)
    else:
        # Families cluster the Gaussians that pruning keeps for the fewest strokes.
        fewest = replace(paint, cluster=replace(paint.cluster, strokes=1))
        prepared = prepare(scene, fewest, report, asks=ASKS)
        subject = Subject(source, prepared, paint, config)
        if of_whole_paintings(config):
            whole = LookSubject.open(source, paint, config, Report())
    report.settings = plain_paint(scene, paint) | {
        "measure": plain_config(config),
        "camera": plain_camera(subject.camera),
        "machine": machine,
    }
    report.result = result = measure(subject, report, whole)
    report.output = str(output)
    title = _title(subject, machine)
    report.write(
        outputs, lambda path: write_plot(result, path, title), texts={".csv": report.result.as_csv()}
    )
    return report


def _make_limit(subject: LookSubject, report: Report) -> None:
    with report.stage("limit") as stage:
        stage.did = f"{len(subject.limit.strokes):,} strokes, the reference of the others"
        stage.counts = {"strokes": len(subject.limit.strokes)}


def _title(subject: Subject | LookSubject, machine: dict[str, Any]) -> str:
    name = subject.source.name
    size = f"{subject.camera.width}x{subject.camera.height}"
    what = f"{name}, {len(subject.gaussians):,} Gaussians, {subject.prepared.texture.name}, {size}"
    return f"{what}, {machine['threads']} threads; filled: on the Pareto front"


# The machine and build of a measurement; a debug build is refused, since its times are meaningless.


def describe_machine(num_threads: int | None = None) -> dict[str, Any]:
    """Compiler and instruction set of the core, Python, processor and threads.

    Raises:
        ValueError: if the core was built without optimization.
    """
    compiler, is_optimised = _core.build()
    if not is_optimised:
        raise ValueError(
            "bench: the core must be a release build, got a debug one; build it with CMAKE_BUILD_TYPE=Release"
        )
    return {
        "compiler": compiler,
        "isa": _core.isa(),
        "python": platform.python_version(),
        "processor": _processor(),
        "threads": num_threads_or_default(num_threads),
    }


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    names = re.findall(r"model name\s*:\s*(.+)", info.read_text()) if info.exists() else []
    return names[0] if names else platform.processor()
