"""The graph of steps: only requested values, and the values that they need, are made.

A step is a plain function. Its name is the name of its output value, its parameters are the names of its
inputs. Steps are not called in order: a caller requests a value, and its inputs are made first, once.
"""

import inspect
import time
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from copy import copy
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np

if TYPE_CHECKING:
    from brushgs.pipeline.explain import Explained

T = TypeVar("T")
KEPT = "kept from an earlier command"  # detail of a stage


class Later(Generic[T]):
    """A value that a step may not need: `def key(light, camera: Later[Camera])`, and in it `camera()`."""

    def __init__(self, make: Callable[[], T]) -> None:
        """Wrap the function that makes it."""
        self._make = make

    def __call__(self) -> T:
        """The value; the steps for it run now, unless they ran before."""
        return self._make()


def makes(*names: str) -> Callable[[Callable[..., T]], Callable[..., T]]:
    """Declare that a step returns a tuple of several values with these names."""

    def named(step: Callable[..., T]) -> Callable[..., T]:
        step.makes = names  # type: ignore[attr-defined]
        return step

    return named


def anew(step: Callable[..., T]) -> Callable[..., T]:
    """Declare that the result of a step is never kept: it changes while it is used."""
    step.is_kept = False  # type: ignore[attr-defined]
    return step


def costly(step: Callable[..., T]) -> Callable[..., T]:
    """Declare that the result of a step may be kept on disk, see `brushgs.pipeline.kept`."""
    step.is_costly = True  # type: ignore[attr-defined]
    return step


class Memory:
    """The last result and inputs of each step, by its name.

    A step is repeated if an input differs. Options are compared by value; arrays, and objects that hold them,
    by identity: a step that is not repeated returns the same object, so later steps find their inputs
    unchanged.

    Attributes:
        made: how often each step has run.
        found: names of steps whose last result came from disk.
    """

    def __init__(self) -> None:
        self.made: Counter[str] = Counter()
        self.found: set[str] = set()
        self._kept: dict[str, tuple[tuple[object, ...], Any]] = {}

    def of(self, step: str, inputs: Sequence[object], make: Callable[[], T], *, is_only: bool = False) -> T:
        """The result of a step: the last one, if its inputs are the same, else a new one.

        Args:
            step: its name.
            inputs: all that its result depends on: options, arrays and objects that hold them, and tuples of
                both.
            make: makes the result; nothing is stored if it raises.
            is_only: whether a job asks once, so that the result may be written before it ends.
        """
        known = self.known(step)
        if known is not None and is_same(known[0], tuple(inputs)):
            result: T = known[1]
            return result
        self.forget(step)
        result = make()
        self.keep(step, tuple(inputs), result)
        return result

    def known(self, step: str) -> tuple[tuple[object, ...], Any] | None:
        """The last inputs of a step, and its result."""
        return self._kept.get(step)

    def forget(self, step: str) -> None:
        """Drop the result of a step, to free its memory."""
        self._kept.pop(step, None)

    def keep(self, step: str, inputs: tuple[object, ...], result: object) -> None:
        """Remember a result."""
        self.made[step] += 1
        self._kept[step] = inputs, result

    def close(self) -> None:
        """Called when a job has ended: what waits for that is kept."""

    def run(
        self,
        step: "Step",
        inputs: Mapping[str, Any],
        used: Mapping[str, Any],
        report: Any,
        make: Callable[[], T],
    ) -> T:
        """Run a step whose result is not known.

        Args:
            step: the step.
            inputs: those that it always takes, without services.
            used: those that it requested, after it ran.
            report: gets its stages.
            make: runs it.
        """
        return make()


class NoMemory(Memory):
    """A memory that keeps nothing, so every step runs."""

    def keep(self, step: str, inputs: tuple[object, ...], result: object) -> None:
        """Forget it."""


_held: ContextVar[Memory | None] = ContextVar("held", default=None)


def held() -> Memory | None:
    """The memory of the enclosing block, see `holding`."""
    return _held.get()


@contextmanager
def holding(memory: Memory | None) -> Iterator[None]:
    """Within the block, jobs without a memory use this one."""
    token = _held.set(memory)
    try:
        yield
    finally:
        _held.reset(token)


def is_same(known: object, other: object) -> bool:
    """Whether two inputs of a step are the same, see `Memory`."""
    if known is other:
        return True
    if isinstance(known, tuple) and isinstance(other, tuple):
        return len(known) == len(other) and all(map(is_same, known, other))
    if isinstance(known, np.ndarray):
        return False
    return (known == other) is True  # objects that hold arrays too are compared by identity


@dataclass(frozen=True)
class Rule:
    """A condition under which a step is not needed.

    Attributes:
        why: function of the deciding values: the reason in words, or None if the step runs.
        takes: names of the deciding values.
        instead: replacements for the step's values: names of other values, or constants.
    """

    why: Callable[..., str | None]
    takes: tuple[str, ...]
    instead: tuple[Any, ...]

    def reason(self, value: Callable[[str], Any]) -> str | None:
        """Why the step is not needed; `value` makes a value by its name."""
        return self.why(**{one: value(one) for one in self.takes})

    def stand_ins(self, value: Callable[[str], Any]) -> list[Any]:
        """The replacements for the step's values."""
        return [value(one) if isinstance(one, str) else one for one in self.instead]

    @property
    def sources(self) -> tuple[str, ...]:
        """Names of the values that replace those of the step."""
        return tuple(one for one in self.instead if isinstance(one, str))


def unless(why: Callable[..., str | None], *instead: Any) -> Callable[[Callable[..., T]], Callable[..., T]]:
    """Declare when a step is not needed, and its values then; see `Rule`. Without `instead` None."""

    def ruled(step: Callable[..., T]) -> Callable[..., T]:
        step.rule = Rule(why, tuple(inspect.signature(why).parameters), instead)  # type: ignore[attr-defined]
        return step

    return ruled


@dataclass(frozen=True)
class Step:
    """A function of a graph.

    Attributes:
        name: of the function.
        run: the function.
        needs: names of its inputs.
        later: those of them that it may not need.
        makes: names of its outputs.
        rule: when it does not run; None if it always runs.
        is_kept: whether a memory keeps its result.
        is_costly: whether its result is worth a file.
    """

    name: str
    run: Callable[..., Any]
    needs: tuple[str, ...]
    later: frozenset[str]
    makes: tuple[str, ...]
    rule: Rule | None
    is_kept: bool
    is_costly: bool

    @classmethod
    def of(cls, run: Callable[..., Any]) -> "Step":
        """A function as a step."""
        parameters = inspect.signature(run).parameters
        later = frozenset(name for name, one in parameters.items() if _is_later(one.annotation))
        names, rule = getattr(run, "makes", (run.__name__,)), getattr(run, "rule", None)
        if rule is not None and not rule.instead:
            rule = replace(rule, instead=(None,) * len(names))
        is_kept, is_costly = getattr(run, "is_kept", True), getattr(run, "is_costly", False)
        return cls(run.__name__, run, tuple(parameters), later, names, rule, is_kept, is_costly)

    @property
    def takes(self) -> tuple[str, ...]:
        """Names of all inputs of the step and of its rule."""
        ruled = () if self.rule is None else (*self.rule.takes, *self.rule.sources)
        return tuple(dict.fromkeys((*ruled, *self.needs)))

    def values_of(self, result: Any) -> Sequence[Any]:
        """A result of the function, as one value per name."""
        return result if len(self.makes) > 1 else (result,)

    @property
    def does(self) -> str:
        """What it makes, in words: the first line of the function's docstring, without the full stop."""
        return (self.run.__doc__ or self.name).strip().splitlines()[0].rstrip(".")


def _is_later(annotation: object) -> bool:
    if isinstance(annotation, str):
        return annotation.startswith(f"{Later.__name__}[")
    return getattr(annotation, "__origin__", None) is Later


class Steps:
    """Functions by the names of their outputs.

    Attributes:
        step_of: the step that makes a value.
        inputs: names of the values that come from outside.
        services: inputs without influence on results, such as the report.
    """

    def __init__(
        self, functions: Iterable[Callable[..., Any]], inputs: Collection[str], services: Collection[str] = ()
    ) -> None:
        """Check that each value can be made.

        Raises:
            TypeError: if steps depend on each other in a circle, an input is made by no step, or two steps
                make the same value.
        """
        self.inputs, self.services = frozenset(inputs), frozenset(services)
        self.step_of: dict[str, Step] = {}
        for step in map(Step.of, functions):
            for name in step.makes:
                if name in self.step_of or name in self.inputs:
                    raise TypeError(f"two steps make {name}, or it is an input")
                self.step_of[name] = step
        sound: set[str] = set(self.inputs)
        for name in self.step_of:
            self._check(name, (), sound)

    def _check(self, name: str, above: tuple[str, ...], sound: set[str]) -> None:
        if name in above:
            raise TypeError(f"steps wait for each other: {' -> '.join((*above, name))}")
        if name in sound:
            return
        if name not in self.step_of:
            raise TypeError(f"step {above[-1]} takes {name}, which no step makes and no input is")
        for one in self.step_of[name].takes:
            self._check(one, (*above, name), sound)
        sound.add(name)

    def altered(self, name: str, change: Callable[[Any, Mapping[str, Any]], Any]) -> "Steps":
        """The same graph with a further change of one value.

        Args:
            name: of the value, the only output of its step.
            change: returns the changed value, given the value and the inputs of its step.
        """
        step = self.step_of[name]

        def run(**needs: Any) -> Any:
            return change(step.run(**needs), needs)

        other = copy(self)
        other.step_of = self.step_of | {name: replace(step, run=run)}
        return other

    def below(self, names: Iterable[str]) -> list[Step]:
        """The steps that some values may depend on, each after the steps of its inputs."""
        found: dict[str, Step] = {}

        def add(name: str) -> None:
            step = self.step_of.get(name)
            if step is not None and step.name not in found:
                for one in step.takes:
                    add(one)
                found.setdefault(step.name, step)

        for name in names:
            add(name)
        return list(found.values())


class Job:
    """One request to a graph; a value is freed as soon as nothing more depends on it.

    Attributes:
        steps: the graph.
        asked: names of the requested values.
        seconds: of each step that ran, without the steps that it waited for.
        skipped: why the others did not run, by name.
    """

    def __init__(
        self, steps: Steps, asked: Sequence[str], inputs: Mapping[str, Any], memory: Memory | None = None
    ) -> None:
        """Nothing runs yet.

        Args:
            steps: the graph.
            asked: names of values.
            inputs: by name, all of them.
            memory: of earlier jobs; None makes every step.
        """
        self.steps, self.asked, self.inputs = steps, tuple(asked), dict(inputs)
        self.seconds: dict[str, float] = {}
        self.skipped: dict[str, str] = {}
        self._memory, self._values = memory or NoMemory(), dict(inputs)
        self._waited = 0.0
        self._done: set[str] = set()  # names of finished steps
        self._readers = Counter(self.asked)  # by value: number of steps that may still take it
        for step in steps.below(asked):
            self._readers.update(step.takes)

    def explain(self, facts: Mapping[str, Any] | None = None) -> "list[Explained]":
        """Which steps would run, and why others would not, without running any costly step.

        `facts` are values that are known beforehand, such as those of a file header.
        """
        from brushgs.pipeline.explain import explain

        return explain(self, facts or {})

    def run(self) -> dict[str, Any]:
        """Make the requested values, and their inputs."""
        return {name: self._value(name) for name in self.asked}

    def _value(self, name: str) -> Any:
        if name not in self._values:
            step = self.steps.step_of[name]
            for one, value in zip(step.makes, self._results(step), strict=True):
                if self._readers[one]:
                    self._values[one] = value
            self._finish(step)
        return self._values[name]

    def _finish(self, step: Step) -> None:
        """Mark a step as finished or skipped: it takes no more inputs."""
        self._done.add(step.name)
        for name in step.takes:
            self._readers[name] -= 1
            if self._readers[name] or name in self.steps.inputs:
                continue
            self._values.pop(name, None)
            maker = self.steps.step_of[name]
            if maker.name not in self._done and not any(self._readers[one] for one in maker.makes):
                self._finish(maker)

    def _results(self, step: Step) -> Sequence[Any]:
        """The outputs of a step: made, remembered or replaced."""
        if step.rule is not None and (why := step.rule.reason(self._value)) is not None:
            self.skipped[step.name] = why
            return step.rule.stand_ins(self._value)
        needs = {one: self._value(one) for one in step.needs if one not in step.later}
        memory = self._memory if step.is_kept else NoMemory()
        known = memory.known(step.name)
        if known is not None and self._is_unchanged(known[0], needs):
            self.skipped[step.name] = "its result is kept"
            return step.values_of(known[1])
        del known
        memory.forget(step.name)
        return step.values_of(self._made(step, needs, memory))

    def _made(self, step: Step, needs: dict[str, Any], memory: Memory) -> Any:
        used: dict[str, Any] = {}  # values requested later are inputs too

        def later(one: str) -> Later[Any]:
            def get() -> Any:
                start, before = time.perf_counter(), self._waited
                used[one] = self._value(one)
                self._waited = before + time.perf_counter() - start
                return used[one]

            return Later(get)

        def make() -> Any:
            return step.run(**needs, **{one: later(one) for one in step.later})

        start, before = time.perf_counter(), self._waited
        always = {one: x for one, x in needs.items() if one not in self.steps.services}
        result = memory.run(step, always, used, self.inputs.get("report"), make)
        self.seconds[step.name] = time.perf_counter() - start - (self._waited - before)
        inputs = {one: x for one, x in (needs | used).items() if one not in self.steps.services}
        memory.keep(step.name, tuple(inputs.items()), result)
        return result

    def _is_unchanged(self, known: tuple[Any, ...], needs: Mapping[str, Any]) -> bool:
        """Whether the inputs of a step are unchanged; inputs that it always takes are compared first."""
        before, services = dict(known), self.steps.services
        at_once = all(is_same(before.get(one), x) for one, x in needs.items() if one not in services)
        return at_once and all(is_same(x, self._value(one)) for one, x in before.items() if one not in needs)
