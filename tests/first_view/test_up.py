import re

import numpy as np
import pytest

from brushgs.cameras.framing import AXES
from brushgs.first_view import find_first_view, rank_ups
from brushgs.first_view.sample import take_sample
from brushgs.first_view.up import PRIORS, SURE, believed_up, up_evidence, up_probabilities
from brushgs.options.painting import ViewConfig
from brushgs.pipeline.report import Report
from brushgs.pipeline.views import choose_first_view
from tests.first_view.scenes import ROTATIONS, about, gaussians, joined, moved, statue

NAMES = list(AXES)
DIRECTIONS = np.array(list(AXES.values()))


def axis_after(rotation, axis):
    """The name of the axis that `axis` becomes."""
    return NAMES[int(np.argmax(DIRECTIONS @ (rotation @ np.array(AXES[axis]))))]


def test_a_statue_stands_upright_whatever_its_axes():
    """Where few scenes have such an axis up it may be unsure, but is never sure of another one."""
    for rotation in ROTATIONS[::3]:
        true = axis_after(rotation, "-y")
        (best, probability), *_ = rank_ups(moved(statue(), rotation=rotation))
        assert best == true
        assert probability >= (SURE if PRIORS[true] >= 0.15 else 0.5)


def test_the_evidence_turns_with_the_scene():
    """Measured: at most 0.006 of log odds, where pictures are turned against their pixels."""
    evidence = dict(zip(NAMES, up_evidence(take_sample(statue())), strict=True))
    for rotation in ROTATIONS[1::4]:
        turned = dict(zip(NAMES, up_evidence(take_sample(moved(statue(), rotation=rotation))), strict=True))
        for axis in NAMES:
            assert turned[axis_after(rotation, axis)] == pytest.approx(evidence[axis], abs=0.02)


def test_probabilities_are_ranked_and_the_best_is_taken_unless_the_default_is_half_as_probable():
    ups = rank_ups(statue())
    assert sorted(axis for axis, _ in ups) == sorted(AXES)
    assert [p for _, p in ups] == sorted((p for _, p in ups), reverse=True)
    assert sum(p for _, p in ups) == pytest.approx(1, abs=1e-12)
    assert dict(up_probabilities(None)) == pytest.approx(PRIORS)  # without anything to see
    assert believed_up((("+z", 0.5), ("+y", 0.26), ("-y", 0.24))) == ("+z", 0.5)
    assert believed_up((("+z", 0.5), ("+y", 0.25), ("-y", 0.25))) == ("-y", 0.25)
    assert believed_up((("-y", 0.4), ("+z", 0.3))) == ("-y", 0.4)


def test_a_fragment_is_never_sure():
    part = statue().take(slice(None, None, 5))
    assert len(part) < 5_000
    ups = rank_ups(part)
    assert ups[0] == ("-y", 0.8)
    assert sum(p for _, p in ups) == pytest.approx(1, abs=1e-12)
    assert find_first_view(part).probability == 0.8


def test_a_tilted_scene_is_seen_level_where_it_has_a_ground():
    rng = np.random.default_rng(0)
    places = rng.uniform(-2, 2, (20000, 3)) * (1, 0, 1) + (0, 0.1, 0)
    ground = gaussians(places, np.tile([0.0, -1, 0], (20000, 1)), 0.04, rng.uniform(0.3, 0.7, (20000, 3)))
    rotation = about((1, 0, 2), 6.0)
    scene = moved(joined(statue(), ground), rotation=rotation)
    report = Report()
    view = choose_first_view(scene, ViewConfig(), None, report)
    assert re.search(r"the ground leans by (5\.|6\.)\d degrees", report.stages[0].details[0])
    assert view.probability >= SURE
    assert np.degrees(np.arccos(view.up @ (rotation @ np.array(AXES["-y"])))) < 1
    head = statue().take(statue().means[:, 1] < -0.25)
    assert np.array_equal(find_first_view(moved(head, rotation=rotation)).up, AXES["-y"])


def test_a_stated_up_is_taken_as_it_is_and_nothing_is_estimated(monkeypatch):
    for name in ("up_probabilities", "level_up"):
        monkeypatch.setattr(f"brushgs.first_view.{name}", None)
    for up, expected in (("+z", (0, 0, 1)), ((0.0, 3.0, 4.0), (0, 0.6, 0.8))):
        view = find_first_view(statue(), up=up, azimuth=1.25)
        assert np.array_equal(view.up, expected)
        assert (view.probability, view.ups, view.azimuth) == (None, (), 1.25)
    for no_direction in ((0.0, 0.0, 0.0), (np.nan, 0.0, 1.0), (0.0, 1.0)):
        with pytest.raises(ValueError, match="up must be a direction"):
            find_first_view(statue(), up=no_direction)
