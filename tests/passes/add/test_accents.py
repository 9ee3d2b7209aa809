"""Accents: small pure lights and darks where a painting lacks them most."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.passes.add.accents import APART, NUM_ACCENTS, accents
from brushgs.rendering.plain import plain_views
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of
from brushgs.values.sh import base_colors, in_colors
from tests.passes.scenes import gaussians_at, grid

CAMERA = Camera.look_at((0, 0, -3), (0, 0, 0), width=160, height=120)
LIGHT, DARK = (0.4, 0.3), (-0.4, -0.2)


def wall(num=60):
    """A grey wall with a small white spot and a small black one."""
    means, colors = grid(num), np.full((num * num, 3), 0.45)
    colors[np.hypot(means[:, 0] - LIGHT[0], means[:, 1] - LIGHT[1]) < 0.1] = 0.98
    colors[np.hypot(means[:, 0] - DARK[0], means[:, 1] - DARK[1]) < 0.1] = 0.03
    return gaussians_at(means, (0.03, 0.03, 0.002), colors, opacity=0.99)


def painted_grey():
    """The wall in few strokes without the spots."""
    strokes = gaussians_at(grid(12), (0.12, 0.1, 0.01), 0.45, opacity=1)
    sh = np.pad(strokes.sh, ((0, 0), (0, 3), (0, 0)))
    return replace(strokes, sh=sh, brushes=np.arange(144, dtype=np.uint8))


def test_lights_and_darks_lie_where_they_are_missing():
    scene, strokes = wall(), painted_grey()
    found = accents(strokes, scene, plain_views(scene, [CAMERA]))
    assert 2 <= len(found) <= NUM_ACCENTS
    lightness = oklab_of(base_colors(found.sh))[:, 0]
    lights, darks = found.take(lightness > 0.6), found.take(lightness < 0.5)
    assert len(lights) >= 1 <= len(darks)
    assert len(lights) + len(darks) == len(found)
    assert lightness.max() > 0.97
    assert lightness.min() < 0.15
    for some, place in ((lights, LIGHT), (darks, DARK)):
        assert np.linalg.norm(some.means[:, :2] - place, axis=1).max() < 0.2
    assert (found.means[:, 2] < 0).all(), "before the wall, as the view sees it"
    assert found.scales.max() < 0.02
    assert found.sh.shape[1] == strokes.sh.shape[1]
    assert not found.sh[:, 1:].any()
    assert found.brushes is not None


def test_accents_are_apart_and_no_more_than_asked_for():
    scene, strokes = wall(), painted_grey()
    views = plain_views(scene, [CAMERA])
    found = accents(strokes, scene, views)
    away = np.linalg.norm(found.means[:, None] - found.means, axis=2) + 9 * np.eye(len(found))
    assert away.min() > 0.5 * APART * 4 * found.scales.max(axis=1).min()
    assert len(found) == 2, "one to each place: side by side they would read as a fence"
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
