"""Which steps a job would run, and why not the others: its graph, followed without any costly step."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

from brushgs.pipeline.runner import Job, Later, Step

Runs = Literal["yes", "no", "undecided"]
_CERTAINTY: dict[Runs, int] = {"no": 0, "undecided": 1, "yes": 2}


@dataclass(frozen=True)
class Explained:
    """A step of a job.

    Attributes:
        name: of the step.
        makes: names of its output values.
        takes: names of its possible input values.
        does: what it makes, in words.
        runs: whether it runs.
        why: the reason if it does not run, or may not.
        is_work: whether it has a stage in the report, or a rule to skip it.
    """

    name: str
    makes: tuple[str, ...]
    takes: tuple[str, ...]
    does: str
    runs: Runs
    why: str
    is_work: bool

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


class _UnknownError(Exception):
    """A value that is known only when the job runs; its argument names it."""


def explain(job: Job, facts: Mapping[str, Any]) -> list[Explained]:
    """Follow the graph of a job.

    Args:
        job: a job that has not run.
        facts: values that are known without running it, such as those of a file header.

    Returns:
        All steps that the requested values may depend on, each after the steps of its inputs.
    """
    return _Explanation(job, facts).steps()


class _Explanation:
    def __init__(self, job: Job, facts: Mapping[str, Any]) -> None:
        graph = job.steps
        self.graph, self.asked = graph, job.asked
        self.known = {name: value for name, value in job.inputs.items() if name not in graph.services}
        self.known |= facts
        self.unknown: dict[str, str] = {}  # values known only when the job runs -> the value that is to blame
        self.used: dict[str, set[str]] = {}  # by evaluated step: values that it requested later
        self.found: dict[str, tuple[Runs, str]] = {}

    def steps(self) -> list[Explained]:
        for name in self.asked:
            self._visit(name, "yes", "")
        nothing: tuple[Runs, str] = "no", "nothing that runs takes it"
        below = self.graph.below(self.asked)
        return [self._explained(step, *self.found.get(step.name, nothing)) for step in below]

    def _explained(self, step: Step, runs: Runs, why: str) -> Explained:
        is_work = "report" in step.needs or step.rule is not None
        return Explained(step.name, step.makes, step.takes, step.does, runs, why, is_work)

    def _visit(self, name: str, runs: Runs, why: str) -> None:
        """Mark a value as needed, for certain or perhaps, and why only perhaps."""
        step = self.graph.step_of.get(name)
        if step is None:
            return
        known = self.found.get(step.name)
        if known is not None and (known[0] == "no" or _CERTAINTY[known[0]] >= _CERTAINTY[runs]):
            return
        self.found[step.name] = runs, why
        if step.rule is not None:
            for one in step.rule.takes:
                self._visit(one, runs, why)
            try:
                reason = step.rule.reason(self._value)
            except _UnknownError as unknown:
                if runs == "yes":
                    runs, why = "undecided", f"decided when {unknown} is known"
                    self.found[step.name] = runs, why
                reason = None
                self._visit_all(step.rule.sources, runs, why)
            if reason is not None:
                self.found[step.name] = "no", reason
                self._visit_all(step.rule.sources, runs, why)
                return
        self._visit_all((one for one in step.needs if one not in step.later), runs, why)
        self._visit_later(step, name, runs, why)

    def _visit_later(self, step: Step, name: str, runs: Runs, why: str) -> None:
        if not step.later:
            return
        try:
            self._value(name)
        except _UnknownError:
            self._visit_all(step.later, "undecided", f"decided when {step.name} runs")
        else:
            self._visit_all(self.used.get(step.name, ()), runs, why)

    def _visit_all(self, names: Any, runs: Runs, why: str) -> None:
        for name in names:
            self._visit(name, runs, why)

    def _value(self, name: str) -> Any:
        """The value, if it follows from options and facts alone."""
        if name in self.known:
            return self.known[name]
        if name in self.unknown:
            raise _UnknownError(self.unknown[name])
        step = self.graph.step_of.get(name)
        if step is None:
            raise _UnknownError(name)
        rule = step.rule
        try:
            is_skipped = rule is not None and rule.reason(self._value) is not None
            made = rule.stand_ins(self._value) if rule is not None and is_skipped else self._made(step)
        except _UnknownError as unknown:
            self.unknown |= dict.fromkeys(step.makes, str(unknown))
            raise
        self.known |= dict(zip(step.makes, made, strict=True))
        return self.known[name]

    def _made(self, step: Step) -> Any:
        if self.graph.services & set(step.needs):
            raise _UnknownError(step.makes[0])
        used: set[str] = set()

        def later(one: str) -> Later[Any]:
            def get() -> Any:
                used.add(one)
                return self._value(one)

            return Later(get)

        needs = {one: self._value(one) for one in step.needs if one not in step.later}
        result = step.run(**needs, **{one: later(one) for one in step.later})
        self.used[step.name] = used
        return step.values_of(result)
