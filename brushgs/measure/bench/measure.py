"""The families one by one: all points of one are painted and verified, then timed in turns."""

from collections.abc import Callable

from brushgs.measure.bench.advice import advice, curves_of
from brushgs.measure.bench.families import Plan, Trial, plan_families
from brushgs.measure.bench.figures import Bench, Family, Point, mark_best
from brushgs.measure.bench.subject import Subject
from brushgs.measure.bench.timing import Run, Spread, time_in_turns
from brushgs.painting.report import Report


def measure(subject: Subject, report: Report) -> Bench:
    """Measure all families asked for.

    Raises:
        WrongPictureError: if a picture is not what it should be; it is not timed then.
    """
    families = []
    for name, plan in plan_families(subject).items():
        num_runs = plan.num_points + subject.config.repeats * plan.num_runs
        with report.stage(name, total=num_runs, unit="runs") as stage:
            if plan.idle is not None:
                stage.did = "not measured"
                stage.skipped.append(f"the whole family: {plan.idle}")
                continue
            family = _measured(name, plan, subject.config.repeats, report.advance)
            families.append(family)
            stage.did = f"{len(family.points)} points, {len(family.best)} of them best: {plan.title}"
            stage.counts = {"points": len(family.points), "best": len(family.best)}
    curves = next((curves_of(family) for family in families if family.name == "strokes"), {})
    return Bench(tuple(families), *advice(curves))


def _measured(name: str, plan: Plan, repeats: int, advance: Callable[[], None]) -> Family:
    trials = []
    for trial in plan.trials():
        trials.append(trial)
        advance()
    runs = [run for trial in trials for parts in trial.runs.values() for run in parts]
    seconds = time_in_turns(runs, repeats, advance)
    points = mark_best(_point(trial, seconds) for trial in trials)
    return Family(name, plan.title, plan.truth, plan.cost, points)


def _point(trial: Trial, seconds: dict[Run, list[float]]) -> Point:
    """The point of a trial; what consists of several runs takes the sum of those of one round."""
    return Point(
        label=trial.label,
        series=trial.series,
        value=trial.value,
        error=trial.error,
        seconds={
            kind: Spread.of([sum(turn) for turn in zip(*(seconds[run] for run in parts), strict=False)])
            for kind, parts in trial.runs.items()
        },
        verified=trial.verified,
        strokes=trial.strokes,
        unpainted=trial.unpainted,
    )
