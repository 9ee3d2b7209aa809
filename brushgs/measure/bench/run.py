"""`brushgs bench`: curves of error against run time of a scene file, as table, JSON, CSV and plot."""

import os
import platform
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.measure.bench.families import FamilyPlan, Trial, plan_families
from brushgs.measure.bench.figures import SCHEMA, Bench, Family, Point, mark_best
from brushgs.measure.bench.look_families import plan_look_families
from brushgs.measure.bench.look_subject import LookSubject, has_look
from brushgs.measure.bench.plot import write_plot
from brushgs.measure.bench.subject import ASKS, Subject
from brushgs.measure.bench.timing import TimedRun, TimeQuartiles, time_alternately
from brushgs.measure.report import (
    ExperimentReport,
    check_opaque_background,
    plain_camera,
    plain_config,
    plain_paint,
)
from brushgs.options.experiments import PLAIN_FAMILIES, BenchConfig
from brushgs.options.painting import PaintConfig
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.pipeline.outputs import input_files
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.stroke_count.curve import ErrorCurve, Knee, knee, psnr_of, value_at

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


# Measure the families one by one: paint and verify all points of a family, then time them alternately.


def measure(subject: Subject | LookSubject, report: Report, whole: LookSubject | None = None) -> Bench:
    """Measure all configured families.

    Args:
        subject: bare strokes, or a painting in a look.
        report: gets a stage for each family.
        whole: whole paintings of bare strokes, for families that need them.

    Raises:
        WrongPictureError: if a picture does not agree with its definition; it is not timed then.
    """
    families, load = [], OtherLoad()
    for name, plan in _plans(subject, whole).items():
        num_runs = plan.num_points + subject.config.repeats * plan.num_runs
        with report.stage(name, total=num_runs, unit="runs") as stage:
            if plan.skip_reason is not None:
                stage.did = "not measured"
                stage.skipped.append(f"the whole family: {plan.skip_reason}")
                continue
            family = _measured(name, plan, subject.config.repeats, report.advance)
            families.append(family)
            num_best = len(family.front(family.kinds[0]))
            stage.did = f"{len(family.points)} points, {num_best} of them best: {plan.title}"
            stage.counts = {"points": len(family.points), "best": num_best}
    knees, words = advice(next((family for family in families if family.name == "strokes"), None))
    return Bench(tuple(families), knees, words, doubts_of(families, load.cores()))


def _plans(subject: Subject | LookSubject, whole: LookSubject | None) -> dict[str, FamilyPlan]:
    if isinstance(subject, LookSubject):
        return plan_look_families(subject, subject.config.families_of(has_look=True))
    plans = plan_families(subject)
    return plans if whole is None else plans | plan_look_families(whole, of_whole_paintings(subject.config))


def of_whole_paintings(config: BenchConfig) -> tuple[str, ...]:
    """The families that need whole paintings even for bare strokes."""
    asked = config.families_of(has_look=False)
    return tuple(name for name in asked if name not in PLAIN_FAMILIES)


def _measured(name: str, plan: FamilyPlan, repeats: int, advance: Callable[[], None]) -> Family:
    trials = []
    for trial in plan.trials():
        trials.append(trial)
        advance()
    runs = [run for trial in trials for parts in trial.runs.values() for run in parts]
    seconds = time_alternately(runs, repeats, advance)
    points = mark_best(_point(trial, seconds) for trial in trials)
    return Family(name, plan.title, plan.truth, plan.cost, points)


def _point(trial: Trial, seconds: dict[TimedRun, list[float]]) -> Point:
    """The point of a trial; a cost of several runs is their sum in each round."""
    return Point(
        label=trial.label,
        series=trial.series,
        value=trial.value,
        error=trial.error,
        seconds={
            kind: TimeQuartiles.of(
                [sum(turn) for turn in zip(*(seconds[run] for run in parts), strict=False)]
            )
            for kind, parts in trial.runs.items()
        },
        verified=trial.verified,
        strokes=trial.strokes,
        unpainted=trial.unpainted,
        clustering=trial.clustering,
        held_out=trial.held_out,
    )


# One line of advice on the number of strokes of a scene, from the knees of its curve.


LEAST_POINTS = 3  # a knee lies between two ends
LEAST_GAIN = 0.05  # dB; less is reported as nothing
OF_TIME = {"frame": "a film", "painting": "a still"}  # product with this time


def curves_of(family: Family) -> dict[str, ErrorCurve]:
    """The curve for each time, "frame" and "painting"; none for fewer than three points.

    The curve of a still has the error of clustering, see `brushgs.stroke_count.curve`; in a look, which is
    compared with itself and has no error of a brush, the same error as that of a film.
    """
    points = {point.strokes: point for point in family.points}  # two counts may give the same strokes
    if len(points) < LEAST_POINTS:
        return {}
    strokes = np.array(sorted(points))
    rmse = np.array([points[count].error.rmse for count in strokes])
    errors = ((points[count].clustering, points[count].error.rmse) for count in strokes)
    clustering = np.array([total if merged is None else merged for merged, total in errors])
    frame, painting = (
        np.array([points[count].seconds[kind].median for count in strokes]) for kind in OF_TIME
    )
    return {
        "frame": ErrorCurve(strokes, rmse, frame),
        "painting": ErrorCurve(strokes, clustering, painting, ends_unmerged=True),
    }


def advice(family: Family | None) -> tuple[dict[str, Knee], str | None]:
    """The knee by each time, and the advice: "for this scene a film is worth 4,100 strokes (28.6 dB, ...".

    Args:
        family: `strokes`; None if it was not measured.
    """
    curves = {} if family is None else curves_of(family)
    if family is None or not curves:
        return {}, None
    bends = {kind: knee(curve) for kind, curve in curves.items()}
    said = [_words(kind, bend, family) for kind, bend in bends.items()]
    return bends, f"for this scene {'; '.join(said)}"


def _words(kind: str, bend: Knee, family: Family) -> str:
    points = sorted(family.points, key=lambda point: point.strokes)
    counts, errors = np.array([(point.strokes, point.error.rmse) for point in points]).T
    reached = psnr_of(value_at(counts, errors, bend.strokes))
    what = f"{OF_TIME[kind]} is worth {_rounded(bend.strokes):,} strokes ({reached:.1f} dB"
    if bend.strokes >= points[-1].strokes:
        return f"{what}, all: merging does not pay)"
    gain = f"{bend.gain_of_doubling:.1f} dB" if bend.gain_of_doubling >= LEAST_GAIN else "nothing"
    return f"{what}; doubling buys {gain} for {bend.cost_of_doubling:.1f} x the time)"


def _rounded(count: int) -> int:
    """Round to two digits, the precision of a knee."""
    return int(round(count, 2 - len(str(count)))) if count >= 100 else count


# Doubts about the figures of a bench: other work on the machine, and a curve that rises again.


STAT = Path("/proc/stat")
BUSY = 0.1  # processors used by other programs: more changes medians
UNSTEADY = 0.25  # distance of the quartiles over the median, for the median point
RISES = 1.02  # error of the last count over the least


class OtherLoad:
    """Measures the processors used by other programs, from its creation on."""

    def __init__(self) -> None:
        self._start = _counters()

    def cores(self) -> float | None:
        """Their mean number until now; None if the system does not report it."""
        before, now = self._start, _counters()
        if before is None or now is None or not now[0] > before[0]:
            return None
        seconds, busy, own = (b - a for a, b in zip(before, now, strict=True))
        return max(0.0, (busy - own) / seconds)


def _counters() -> tuple[float, float, float] | None:
    """Seconds of the clock, of all processors in use, and of those used by this process."""
    try:
        ticks = [float(word) for word in STAT.read_text().split("\n", 1)[0].split()[1:9]]
    except (OSError, ValueError):
        return None
    if len(ticks) < 8 or not any(ticks):
        return None
    user, nice, system, _idle, _waits, irq, soft_irq, stolen = ticks
    used = os.times()
    own = used.user + used.system + used.children_user + used.children_system
    busy = user + nice + system + irq + soft_irq + stolen
    return used.elapsed, busy / os.sysconf("SC_CLK_TCK"), own


def doubts_of(families: Sequence[Family], cores: float | None) -> tuple[str, ...]:
    """A sentence for each doubt about the figures.

    Args:
        families: the measured families.
        cores: processors used by other programs meanwhile; None if not known.
    """
    found = []
    if cores is not None and cores > BUSY:
        found.append(
            f"other programs used {cores:.1f} processors meanwhile: measure again on a quiet machine"
        )
    points = [point for family in families for point in family.points]
    spreads = [(point.cost.q3 - point.cost.q1) / point.cost.median for point in points]
    if spreads and (spread := float(np.median(spreads))) > UNSTEADY:
        found.append(f"times are unsteady: their quartiles lie {spread:.0%} of the median apart")
    strokes = next((family.points for family in families if family.name == "strokes"), ())
    return (*found, *_rise(strokes))


def _rise(points: Sequence[Point]) -> list[str]:
    """A doubt if the error of a brush is not least with all strokes."""
    if len(points) < 2:
        return []
    least, last = min(points, key=lambda point: point.error.rmse), points[-1]
    if not last.error.rmse > RISES * least.error.rmse:
        return []
    errors = f"{255 * least.error.rmse:.3g} to {255 * last.error.rmse:.3g} of 255"
    return [f"the error rises again beyond {least.strokes:,} strokes, from {errors} with {last.strokes:,}"]
