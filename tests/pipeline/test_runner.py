"""What is asked of a graph is made, nothing else, and nothing twice; a painting that is kept is the same."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from brushgs.options.look import Look
from brushgs.options.painting import PaintConfig
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.runner import Job, Later, Memory, NoMemory, Steps, holding, is_same, unless
from brushgs.pipeline.still import paint_view
from tests.kit import changed as kit_changed
from tests.kit import for_each, still_life_of
from tests.passes.scenes import assert_same

SCENE = still_life_of(1000)
SMALL = {"cluster": {"strokes": 60}, "view": {"size": (64, 48)}, "ground": {"stage": False}}
OIL = kit_changed(Look.open("oil").config, **SMALL)

LONG = {"read", "cleaned", "first_view", "planned", "ground", "plain_views", "own_brushes", "pruned", "focus"}
LONG |= {"cluster", "solid", "direction", "repaint", "site", "key"}


@pytest.fixture(scope="module")
def remembered():
    """A memory in which `OIL` is painted."""
    memory = Memory()
    prepare(SCENE, OIL, Report(), memory=memory)
    return memory


def changed(step, **values):
    return kit_changed(OIL, **{step: values})


def copy_of(memory):
    """A memory that holds the same results."""
    other = Memory()
    other.made, other._kept = memory.made.copy(), memory._kept.copy()
    return other


LIT = {"site", "key"}  # where the scene stands, and its lamp
MADE = {"cluster", "solid", "direction", "repaint"}
CHANGES = [
    (OIL, set()),
    (changed("light", relief=0.9), set()),
    (changed("light", lamp=(1.0, 0.5)), LIT),
    (changed("light", canvas="paper"), {"ground"}),
    (changed("ground", ground="#336699"), {"ground"}),
    (changed("color", chroma=2.0), set()),
    (changed("draw", streaks=0.3), set()),
    (replace(changed("draw", stroke="dab"), brushes=PaintConfig().brushes), {"own_brushes"}),
    (changed("cluster", strokes=40), MADE),
    (changed("cluster", strokes=3000), {"pruned", "focus"} | MADE | LIT),  # more than pruning would keep
    (changed("prune", keep=0.5), {"pruned", "focus"} | MADE | LIT),
    (changed("strokes", solid=False), {"cluster", "direction", "repaint"}),
]


@for_each(("config", "steps"), CHANGES)
def test_only_steps_whose_inputs_changed_are_made_again(remembered, config, steps):
    memory = copy_of(remembered)
    prepare(SCENE, config, Report(), memory=memory)
    assert set(memory.made - remembered.made) & LONG == steps


def test_arrays_are_compared_by_identity_and_options_by_value_and_failures_are_forgotten():
    memory, array, other = Memory(), np.zeros(3), np.zeros(3)
    first = memory.of("a", (array, (1, "x")), object)
    assert memory.of("a", (array, (1, "x")), object) is first
    assert memory.of("a", (other, (1, "x")), object) is not first
    assert memory.of("a", (array, (1,)), object) is not first
    with pytest.raises(ZeroDivisionError):
        memory.of("a", (2,), lambda: 1 // 0)
    memory.of("a", (array, (1,)), object)
    assert memory.made == {"a": 4}
    one = np.ones(3)
    assert is_same((one, 2), (one, 2))
    assert not is_same((one, 2), (np.ones(4), 2))
    assert not is_same(2, one)


def graph(*functions, inputs=("x",), services=("report",)):
    return Steps(functions, (*inputs, *services), services)


def make(steps, asked, memory=None, **inputs):
    job = Job(steps, asked, {"report": None} | inputs, memory)
    return job.run(), job


def test_a_step_takes_the_values_that_its_parameters_name_and_what_nobody_asks_for_is_not_made():
    def double(x):
        return 2 * x

    def both(x, double):
        return x + double

    def other(x):
        raise AssertionError

    found, job = make(graph(double, both, other), ["both"], x=3)
    assert found == {"both": 9}
    assert list(job.seconds) == ["double", "both"]


def test_a_circle_a_missing_input_and_a_value_of_two_steps_are_refused_before_anything_runs():
    def a(b):
        return b

    def b(a):
        return a

    def c(nothing):
        return nothing

    def x(report):
        return report

    with pytest.raises(TypeError, match="a -> b -> a"):
        graph(a, b)
    with pytest.raises(TypeError, match="step c takes nothing, which no step makes"):
        graph(c)
    with pytest.raises(TypeError, match="two steps make x"):
        graph(x)


def test_a_value_for_later_is_made_only_when_it_is_called():
    def long(x):
        return x

    def chosen(x, long: Later[int]):
        return long() if x > 1 else 0

    steps = graph(long, chosen)
    assert make(steps, ["chosen"], x=1)[1].seconds.keys() == {"chosen"}
    assert make(steps, ["chosen"], x=2)[0] == {"chosen": 2}


def test_a_rule_skips_a_step_and_what_only_it_takes_and_says_why():
    def costly(x):
        return 10 * x

    @unless(lambda x: "x is small" if x < 5 else None, "x")
    def larger(costly):
        return costly

    steps = graph(costly, larger)
    found, job = make(steps, ["larger"], x=3)
    assert (found, job.seconds, job.skipped) == ({"larger": 3}, {}, {"larger": "x is small"})
    assert make(steps, ["larger"], x=6)[0] == {"larger": 60}


class Value:
    """Something that can be watched."""


def test_a_value_is_freed_after_its_last_reader_also_one_that_does_not_run():
    born = []

    def first(x):
        born.append(weakref.ref(value := Value()))
        return value

    @unless(lambda x: "never" if x else None)
    def never(first):
        raise AssertionError

    def second(first):
        return Value()

    def third(second, never):
        gc.collect()
        return born[0]() is None

    assert make(graph(first, never, second, third), ["third"], x=1)[0] == {"third": True}


def test_a_step_is_made_again_exactly_if_an_input_of_it_changed():
    def half(x):
        return x // 2

    def shown(half, y):
        return [half, y]

    steps, memory = graph(half, shown, inputs=("x", "y")), Memory()
    first = make(steps, ["shown"], memory, x=4, y=1)[0]["shown"]
    again, job = make(steps, ["shown"], memory, x=5, y=1)
    assert again["shown"] is first  # half of it is the same
    assert job.seconds.keys() == {"half"}
    assert make(steps, ["shown"], memory, x=5, y=2)[1].seconds.keys() == {"shown"}


def test_a_value_that_was_called_later_is_an_input_too():
    def long(x):
        return x

    def shown(y, long: Later[int]):
        return [long()] if y else []

    steps, memory = graph(long, shown, inputs=("x", "y")), Memory()
    make(steps, ["shown"], memory, x=1, y=True)
    assert make(steps, ["shown"], memory, x=2, y=True)[0] == {"shown": [2]}
    assert make(steps, ["shown"], memory, x=3, y=False)[1].seconds.keys() == {"shown"}  # and not long


def test_one_memory_paints_every_change_of_options_as_a_fresh_job():
    """The views that strokes are made by once were kept though they belonged to another job."""
    memory = Memory()
    configs = {name: changed("cluster", strokes_for=name) for name in ("scene", "view")}
    anew = {name: prepare(SCENE, config, Report()) for name, config in configs.items()}
    for name in ("scene", "view", "scene"):
        assert_same(prepare(SCENE, configs[name], Report(), memory=memory).strokes, anew[name].strokes)


OPTIONS = {
    "cluster": {"strokes_for": ["scene", "view"], "strokes": [40, 60]},
    "strokes": {"see": ["views", "off"], "economy": [0, 1.0], "edges": [0, 0.9], "depth_of_field": [0, 0.6]},
    "light": {"key": [0.0, 0.5], "lamp": [None, (1.0, 0.5)]},
    "ground": {"stage": [False, True]},
    "view": {"azimuth": [None, 1.0]},
    "clean": {"floaters": ["off", "sure"]},
}


@settings(max_examples=2, deadline=None)
@given(data=st.data())
def test_kept_results_never_change_a_painting(data):
    """Of another job that was painted before."""

    def drawn(fields):
        return {name: data.draw(st.sampled_from(choices)) for name, choices in fields.items()}

    memory = Memory()
    for _ in range(2):
        config = kit_changed(OIL, **{step: drawn(fields) for step, fields in OPTIONS.items()})
        kept = prepare(SCENE, config, Report(), memory=memory)
    anew = prepare(SCENE, config, Report())
    assert np.array_equal(paint_view(kept, Report()).rgb, paint_view(anew, Report()).rgb)


def test_a_held_memory_serves_jobs_that_are_given_none():
    """A bench times whole paintings: it gives one that keeps nothing, also in a batch."""

    def stages(memory=None):
        report = Report()
        prepare(SCENE, OIL, report, memory=memory)
        return {stage.name for stage in report.stages}

    with holding(Memory()):
        whole = stages()
        assert "clean" in whole - stages()
        assert stages(NoMemory()) == whole
    assert stages() == whole
