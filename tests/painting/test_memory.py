"""A painting that is changed a little is not made all anew, and is the same as one that is."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.options.look import Look
from brushgs.options.painting import ErrorBudget, PaintConfig
from brushgs.painting.memory import Memory, NoMemory
from brushgs.painting.prepare import prepare
from brushgs.painting.report import Report
from brushgs.painting.still import paint_view
from brushgs.still_life import still_life

SCENE = still_life(1000)
OIL = Look.open("oil").config
OIL = replace(OIL, cluster=replace(OIL.cluster, strokes=60), view=replace(OIL.view, size=(64, 48)))


def made_anew(memory, config):
    """What a painting is, and the steps that were made for it."""
    before = memory.made.copy()
    prepared = prepare(SCENE, config, Report(), memory=memory)
    return prepared, set(memory.made - before)


@pytest.fixture(scope="module")
def remembered():
    return Memory()


def changed(step, **values):
    return replace(OIL, **{step: replace(getattr(OIL, step), **values)})


LIT = {"site", "key"}  # where the scene stands, and its lamp
CHANGES = [
    (OIL, set()),
    (changed("light", relief=0.9), set()),
    (changed("light", lamp=(1.0, 0.5)), LIT),
    (changed("light", canvas="paper"), {"ground"}),
    (changed("ground", ground="#336699"), {"ground"}),
    (changed("color", chroma=2.0), set()),
    (changed("draw", streaks=0.3), set()),
    (replace(changed("draw", stroke="dab"), brushes=PaintConfig().brushes), {"stroke"}),
    (changed("cluster", strokes=40), {"prune", "focus", "cluster", "solid", "direction", "repaint"} | LIT),
    (changed("prune", keep=0.5), {"prune", "focus", "cluster", "solid", "direction", "repaint"} | LIT),
    (changed("strokes", solid=False), {"cluster", "direction", "repaint"}),
]


@pytest.mark.parametrize(("config", "steps"), CHANGES, ids=range(len(CHANGES)))
def test_only_steps_whose_inputs_changed_are_made_again(remembered, config, steps):
    made_anew(remembered, OIL)
    _, made = made_anew(remembered, config)
    assert made == steps


@pytest.mark.parametrize("config", [config for config, _ in CHANGES[1:4]] + [ErrorBudget(15.0)], ids=range(4))
def test_a_painting_with_a_memory_is_the_same_as_one_without(remembered, config):
    if isinstance(config, ErrorBudget):
        config = changed("cluster", strokes=config)
    made_anew(remembered, OIL)
    prepared, _ = made_anew(remembered, config)
    anew = prepare(SCENE, config, Report())
    assert np.array_equal(paint_view(prepared, Report()).rgb, paint_view(anew, Report()).rgb)


def test_arrays_are_compared_by_identity_and_options_by_value():
    memory, array, other = Memory(), np.zeros(3), np.zeros(3)
    first = memory.of("a", (array, (1, "x")), object)
    assert memory.of("a", (array, (1, "x")), object) is first
    assert memory.of("a", (other, (1, "x")), object) is not first
    assert memory.of("a", (array, (1,)), object) is not first
    assert memory.made == {"a": 3}


def test_a_step_that_fails_is_forgotten():
    memory = Memory()
    memory.of("a", (1,), object)
    with pytest.raises(ZeroDivisionError):
        memory.of("a", (2,), lambda: 1 // 0)
    memory.of("a", (1,), object)
    assert memory.made == {"a": 2}


def test_without_a_memory_all_is_made():
    assert NoMemory().of("a", (), object) is not NoMemory().of("a", (), object)
