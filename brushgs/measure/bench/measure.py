"""Measure the families one by one: paint and verify all points of a family, then time them alternately."""

from collections.abc import Callable

from brushgs.measure.bench.advice import advice
from brushgs.measure.bench.doubts import OtherLoad, doubts_of
from brushgs.measure.bench.families import FamilyPlan, Trial, plan_families
from brushgs.measure.bench.figures import Bench, Family, Point, mark_best
from brushgs.measure.bench.look_families import plan_look_families
from brushgs.measure.bench.look_subject import LookSubject
from brushgs.measure.bench.subject import Subject
from brushgs.measure.bench.timing import TimedRun, TimeQuartiles, time_alternately
from brushgs.options.experiments import PLAIN_FAMILIES, BenchConfig
from brushgs.pipeline.report import Report


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
