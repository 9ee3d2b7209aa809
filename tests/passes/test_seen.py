"""Strokes go where views show something, and in the colors that are seen there."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.measure.likeness import psnr
from brushgs.passes.reduce.cluster import group
from brushgs.passes.seen import seen_in
from brushgs.rendering.plain import PlainViews
from brushgs.values.sh import base_colors
from tests.passes.scenes import gaussians_at, grid
from tests.scenes import still_life_of

KERNEL = bg.StrokeTexture.open("gaussian")
DAB = bg.StrokeTexture.open("ellipse")
WHITE = (1.0, 1.0, 1.0)


def cameras(count=6, *, width=120, height=90, distance=4.0, shift=0.0):
    """Cameras in a level ring around the origin."""
    angles = 2 * np.pi * (np.arange(count) + shift) / count
    eyes = distance * np.stack([np.sin(angles), np.full(count, -0.3), -np.cos(angles)], axis=1)
    return [bg.Camera.look_at(eye, (0, 0, 0), width=width, height=height) for eye in eyes]


def squares(*, num=40, far_side=(0.5, 0.5, 0.5)):
    """A wall of opaque dots, black on its left half and white on its right; another behind it."""
    near = grid(num)
    means = np.concatenate([near, grid(num, z=1.0)])
    colors = np.where(near[:, :1] < 0, 0.0, 1.0) * np.ones(3)
    colors = np.concatenate([colors, np.tile(far_side, (num * num, 1))])
    return gaussians_at(means, (0.03, 0.03, 0.001), colors, opacity=0.95, dtype=np.float32)


FRONT = [bg.Camera.look_at((0, 0, -3), (0, 0, 0), width=120, height=90)]


def mean_psnr(strokes, scene, views):
    return np.mean(
        [psnr(bg.render(strokes, v, DAB).over(WHITE), bg.render(scene, v, KERNEL).over(WHITE)) for v in views]
    )


def test_strokes_for_views_are_nearer_to_the_scene_also_in_views_that_were_not_used():
    scene, used, unused = still_life_of(20_000), cameras(8), cameras(8, shift=0.5)
    before = bg.cluster(scene, 600)
    after = bg.repaint(bg.cluster(scene, 600, views=used), scene, used)
    assert len(after) <= 600
    for views in (used, unused):
        assert mean_psnr(after, scene, views) > mean_psnr(before, scene, views) + 1


def test_twice_the_focus_is_about_twice_the_strokes_there_and_the_same_total():
    scene = squares(far_side=(0, 0, 0))
    x, y = scene.means[:, 0], np.abs(scene.means[:, 1])  # halves differ by focus only
    waves = np.stack([np.sin(9 * x), np.sin(14 * y), np.sin(7 * x + 11 * y)], axis=1)
    scene = replace(scene, sh=waves[:, None].astype(np.float32))
    focus = np.where(scene.means[:, 1] < 0, 2.0, 1.0)
    strokes = bg.cluster(scene, 400, views=FRONT, focus=focus)
    up = np.count_nonzero(strokes.means[:, 1] < 0)
    assert 1.5 < up / (len(strokes) - up) < 2.6
    assert 380 <= len(strokes) <= 400


def test_the_seen_color_of_a_thin_layer_is_that_of_what_shows_through():
    scene = squares(far_side=(1, 0, 0))
    opacities = scene.opacities.copy()
    opacities[:1600] = 0.02
    scene = replace(scene, opacities=opacities)
    seen = seen_in(scene, bg.plain_views(scene, FRONT))
    colors = base_colors(seen.gaussians.sh[:1600])
    inner = (np.abs(scene.means[:1600, :2]) < 0.7).all(axis=1)
    assert colors[inner, 0].mean() > 0.85
    assert colors[inner, 1:].max() < 0.25


def test_repainting_recovers_colors_that_were_lost():
    scene = squares()
    views = bg.plain_views(scene, FRONT)
    strokes = replace(scene, sh=np.zeros_like(scene.sh))
    found = bg.repaint(strokes, scene, views)
    assert mean_psnr(found, scene, FRONT) > mean_psnr(strokes, scene, FRONT) + 10
    again = bg.repaint(found, scene, views, num_steps=10)  # converges
    assert mean_psnr(again, scene, FRONT) > mean_psnr(found, scene, FRONT) - 0.05
    colors = base_colors(found.sh[:1600])
    x = scene.means[:1600, 0]
    assert np.median(colors[x < -0.1]) < 0.1
    assert np.median(colors[x > 0.1]) > 0.9


def test_strokes_not_worth_keeping_are_replaced():
    scene = squares()
    whole = group(scene, 150, views=FRONT)

    def is_left(strokes):
        return strokes.means[:, 0] < 0

    part = group(scene, 150, views=FRONT, worth_keeping=is_left)
    assert part.num_clusters > whole.num_clusters
    assert 140 <= np.count_nonzero(is_left(part.merged("cover"))) <= 160


def test_a_view_that_shows_nothing_changes_nothing():
    scene = squares()
    away = [bg.Camera.look_at((0, 0, -3), (0, 0, -9), width=40, height=30)]
    plain, seen = bg.cluster(scene, 60), bg.cluster(scene, 60, views=away)
    np.testing.assert_array_equal(plain.means, seen.means)
    repainted = bg.repaint(plain, scene, away)
    np.testing.assert_allclose(repainted.sh, plain.sh, atol=1e-6)


def test_wrong_views_are_named():
    scene = squares()
    with pytest.raises(ValueError, match="at least one camera"):
        bg.repaint(scene, scene, [])
    frame = bg.render(scene, FRONT[0], KERNEL)
    with pytest.raises(ValueError, match="size of its camera"):
        PlainViews((FRONT[0].resized(60, 45),), (frame,))
    with pytest.raises(ValueError, match="one frame per camera"):
        PlainViews(tuple(FRONT), ())
    with pytest.raises(ValueError, match="focus must be > 0"):
        bg.cluster(scene, 50, focus=np.zeros(len(scene)))
