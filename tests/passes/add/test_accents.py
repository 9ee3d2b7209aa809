"""Accents: small pure lights and darks where a painting lacks them most."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.passes.add.accents import accents
from brushgs.rendering.plain import plain_views
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of
from brushgs.values.sh import base_colors, in_colors
from tests.passes.scenes import gaussians_at, grid

CAMERA = Camera.look_at((0, 0, -3), (0, 0, 0), width=160, height=120)
LIGHT, DARK = (0.4, 0.3), (-0.4, -0.2)


def wall():
    """A grey wall with a small white spot and a small black one."""
    means, colors = grid(60), np.full((3600, 1), 0.45)
    for place, tone in ((LIGHT, 0.98), (DARK, 0.03)):
        colors[np.linalg.norm(means[:, :2] - place, axis=1) < 0.1] = tone
    return gaussians_at(means, (0.03, 0.03, 0.002), colors, opacity=0.99)


def painted_grey():
    """The wall in few strokes without the spots."""
    strokes = gaussians_at(grid(12), (0.12, 0.1, 0.01), 0.45, opacity=1)
    sh = np.pad(strokes.sh, ((0, 0), (0, 3), (0, 0)))
    return replace(strokes, sh=sh, brushes=np.arange(144, dtype=np.uint8))


def test_lights_and_darks_lie_where_they_are_missing_and_no_more_than_asked_for():
    scene, strokes = wall(), painted_grey()
    views = plain_views(scene, [CAMERA])
    found = accents(strokes, scene, views)
    assert len(found) == 2, "one to each place: side by side they would read as a fence"
    light, dark = oklab_of(base_colors(found.sh))[:, 0]
    assert light > 0.97
    assert dark < 0.15
    assert np.linalg.norm(found.means[:, :2] - (LIGHT, DARK), axis=1).max() < 0.2
    assert (found.means[:, 2] < 0).all(), "before the wall, as the view sees it"
    assert found.scales.max() < 0.02
    assert found.sh.shape[1] == strokes.sh.shape[1]
    assert not found.sh[:, 1:].any()
    assert found.brushes is not None
    assert len(accents(strokes, scene, views, count=1)) == 1
    assert len(accents(strokes, scene, views, count=0)) == 0


def test_a_focus_says_which_come_first():
    scene, strokes = wall(), painted_grey()
    for side in (1, -1):
        focus = np.where(side * scene.means[:, 0] > 0, 1e3, 1e-3)
        found = accents(strokes, scene, plain_views(scene, [CAMERA]), count=1, focus=focus)
        assert side * found.means[0, 0] > 0


@pytest.mark.parametrize("scale", [0.0, 1e20])
def test_extreme_input_gives_finite_strokes(scale):
    scene = wall()
    views = plain_views(scene, [CAMERA])
    for strokes in (painted_grey().take([0]), replace(painted_grey(), scales=np.full((144, 3), scale))):
        found = accents(strokes, scene, views)
        assert np.isfinite(found.means).all()
    none = painted_grey().take(slice(0, 0))
    assert len(accents(none, scene, views)) == 0
    assert len(accents(painted_grey(), scene.take(slice(0, 0)), views)) == 0
    even = in_colors(scene, np.full((len(scene), 3), 0.45))
    assert len(accents(painted_grey(), even, plain_views(even, [CAMERA]))) == 0
    same = replace(scene, means=np.zeros_like(scene.means))
    assert np.isfinite(accents(painted_grey(), same, plain_views(same, [CAMERA])).means).all()
