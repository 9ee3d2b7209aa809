"""What a painter adds to what he sees: light, values, edges and economy, in a whole painting."""

from dataclasses import replace
from itertools import pairwise
from math import radians

import numpy as np
import pytest

from brushgs.options.look import Look
from brushgs.options.sequence import PathConfig
from brushgs.pipeline.frame_painter import FrameKind, FramePainter, FrameView
from brushgs.pipeline.media.materials import ACCENTS, BACKDROP
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from tests.kit import BLIND, changed, stages, still_life_of

ADDED = {"focus", "slabs", "key", "edges", "values", "accents"}  # stages
SCENE = still_life_of(1500)


def oil(**light):
    """Frames of it are painted without a track."""
    own = {"draw": {"lock": "anchor"}, "light": light, "ground": {"backdrop_always": True}}
    sized = {"size": (96, 72), "up": (0, -1, 0)}
    return changed(Look.open("oil").config, cluster={"strokes": 500}, view=sized, **own)


def without(config):
    off = {"economy": 0.0, "edges": 0.0, "focus": None}
    return changed(config, light={"key": 0.0}, color={"values": 0.0}, strokes=off)


def painted(config, **options):
    report = Report()
    return prepare(SCENE, config, report, **options), report


def test_a_look_adds_all_of_it_and_nothing_where_it_is_switched_off():
    found, report = painted(oil())
    assert ADDED - {"slabs"} <= set(stages(report))
    assert [coat.name for coat in found.painting.coats] == [BACKDROP, "strokes", ACCENTS]
    bare, report = painted(without(oil()))
    assert not ADDED & set(stages(report))
    assert [coat.name for coat in bare.painting.coats] == [BACKDROP, "strokes"]
    assert bare.painting.lamp.towards is None


def test_the_light_on_strokes_comes_from_the_lamp():
    """Lit from the other side, what was light is dark; places and brushes stay."""
    suns = (oil(key=1.0, sun=(radians(azimuth), radians(25))) for azimuth in (-70, 70))
    left, right = (painted(replace(config, color=without(oil()).color))[0] for config in suns)
    np.testing.assert_array_equal(left.strokes.means, right.strokes.means)
    np.testing.assert_array_equal(left.strokes.brushes, right.strokes.brushes)
    lightness = [found.strokes.sh[:, 0].mean(axis=1) for found in (left, right)]
    assert np.abs(lightness[0] - lightness[1]).mean() > 0.05
    assert left.painting.lamp.towards != right.painting.lamp.towards


def test_a_day_passes_over_a_film(monkeypatch):
    monkeypatch.setattr("brushgs.pipeline.lamp.SUN_STEP", 30.0)  # degrees; each sun lights all strokes
    sun = tuple(map(radians, (-60.0, 20.0, 60.0, 40.0)))
    config = changed(oil(key=0.8, sun=sun), strokes=BLIND)

    def film():
        found, _ = painted(config, views=PathConfig(orbit=4))
        painter = FramePainter(found.painting, found.background, FrameKind(None))
        last = len(found.cameras) - 1
        views = [FrameView(i, found.cameras[0], hour=i / last) for i in range(last + 1)]
        return found, lambda index: painter.frame(views[index]).rgb

    found, frame = film()
    assert set(found.painting.day.shifts) == {BACKDROP, "strokes"}
    frames = [frame(index) for index in range(4)]
    steps = [np.abs(after - before).mean() for before, after in pairwise(frames)]
    assert min(steps) > 0.002
    assert np.abs(frames[-1] - frames[0]).mean() > max(steps)
    _, alone = film()  # a frame that is painted first, or alone, is the same
    np.testing.assert_array_equal(alone(2), frames[2])


def test_a_sun_that_passes_needs_a_film():
    with pytest.raises(ValueError, match="sun passes over a film only; add --orbit or --path"):
        painted(oil(sun=(0.1, 0.5, 1.0, 0.5)))
