"""What a painter adds to what he sees: light, values, edges and economy, in a whole painting."""

from dataclasses import replace
from functools import cache
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
from tests.scenes import still_life_of

ADDED = {"focus", "slabs", "key", "edges", "values", "accents"}  # stages
SCENE = still_life_of(1500)


def oil(**light):
    config = Look.open("oil").config
    return replace(
        config,
        cluster=replace(config.cluster, strokes=500),
        draw=replace(config.draw, lock="anchor"),  # frames below are painted without a track
        view=replace(config.view, size=(96, 72), up=(0, -1, 0)),
        light=replace(config.light, **light),
        ground=replace(config.ground, backdrop_always=True),
    )


def blind(config):
    """Strokes that do not see, which takes most of the time of a film."""
    return replace(config, strokes=replace(config.strokes, see="off"))


def without(config):
    return replace(
        config,
        light=replace(config.light, key=0.0),
        color=replace(config.color, values=0.0),
        strokes=replace(config.strokes, economy=0.0, edges=0.0, focus=None),
    )


def painted(config, **options):
    report = Report()
    return prepare(SCENE, config, report, **options), report


@cache
def in_oil():
    """`oil()` once, for all that is asked of it."""
    return painted(oil())


def stages(report):
    return {stage.name for stage in report.stages}


def test_a_look_adds_all_of_it_and_nothing_where_it_is_switched_off():
    found, report = in_oil()
    assert ADDED - {"slabs"} <= stages(report)
    assert [coat.name for coat in found.painting.coats] == [BACKDROP, "strokes", ACCENTS]
    bare, report = painted(without(oil()))
    assert not ADDED & stages(report)
    assert [coat.name for coat in bare.painting.coats] == [BACKDROP, "strokes"]
    assert bare.painting.lamp.towards is None


def test_the_light_on_strokes_comes_from_the_lamp():
    """Lit from the other side, what was light is dark; places and brushes stay."""
    left, right = (
        painted(replace(oil(key=1.0, sun=(radians(azimuth), radians(25))), color=without(oil()).color))[0]
        for azimuth in (-70, 70)
    )
    np.testing.assert_array_equal(left.strokes.means, right.strokes.means)
    np.testing.assert_array_equal(left.strokes.brushes, right.strokes.brushes)
    lightness = [found.strokes.sh[:, 0].mean(axis=1) for found in (left, right)]
    assert np.abs(lightness[0] - lightness[1]).mean() > 0.05
    assert left.painting.lamp.towards != right.painting.lamp.towards


def frames_of(found):
    painter = FramePainter(found.painting, found.background, FrameKind(None))
    last = len(found.cameras) - 1
    views = [FrameView(i, found.cameras[0], hour=i / last) for i in range(last + 1)]
    return [painter.frame(view).rgb for view in views]


@pytest.fixture
def few_suns(monkeypatch):
    """A day has a sun each so many degrees, and each lights all strokes."""
    monkeypatch.setattr("brushgs.pipeline.lamp.SUN_STEP", 30.0)


def test_a_day_passes_over_a_film(few_suns):
    sun = tuple(map(radians, (-60.0, 20.0, 60.0, 40.0)))
    found, _ = painted(blind(oil(key=0.8, sun=sun)), views=PathConfig(orbit=4))
    assert set(found.painting.day.shifts) == {BACKDROP, "strokes"}
    frames = frames_of(found)
    steps = [np.abs(after - before).mean() for before, after in pairwise(frames)]
    assert min(steps) > 0.002
    assert np.abs(frames[-1] - frames[0]).mean() > max(steps)
    # A frame that is painted first, or alone, is the same.
    again = painted(blind(oil(key=0.8, sun=sun)), views=PathConfig(orbit=4))[0]
    painter = FramePainter(again.painting, again.background, FrameKind(None))
    alone = painter.frame(FrameView(2, again.cameras[0], hour=2 / 3)).rgb
    np.testing.assert_array_equal(alone, frames[2])


def test_a_sun_that_passes_needs_a_film():
    with pytest.raises(ValueError, match="sun passes over a film only; add --orbit or --path"):
        painted(oil(sun=(0.1, 0.5, 1.0, 0.5)))
