"""A stage in the hand of paintings: where its map lies, how marks run on it, how its subject stands out."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.cameras.framing import frame_scene, plain_first_view
from brushgs.passes.add.set_off import lightened, set_off
from brushgs.passes.add.stage_map import Manner, Part, layout_of, map_contrasts, places_on
from brushgs.passes.add.stage_paint import Brushwork, painted_stage
from brushgs.passes.add.stage_surface import Spots
from brushgs.rendering.plain import plain_views
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.quats import rotation_matrices
from brushgs.values.sh import base_colors
from brushgs.values.style import MarkDictionary, StyleStage
from tests.kit.for_each import for_each
from tests.passes.add.test_stage import SIZE, crate, stage_of
from tests.passes.scenes import gaussians_at

COLUMNS = 60


def manner(color=1.0, *, top=(0.2, 0.3, 0.7), low=(0.6, 0.5, 0.2), angle=0.0, marks=1.0, size=0.02):
    """Two colors, one above the other, and marks of one direction."""
    colors = np.empty((20, COLUMNS, 3), np.float32)
    colors[:12], colors[12:] = top, low
    pair = np.array([np.cos(2 * angle), np.sin(2 * angle)], np.float32)
    stage = StyleStage(colors, np.broadcast_to(pair, (20, COLUMNS, 2)).copy())
    return Manner([Part(stage, color, 1.0)], size, 4.0, marks, (0.0, 0.0))


def turned_by(strokes, camera, degrees):
    """By how many degrees strokes run another way than this in a picture, and how well they agree, 0 to 1."""
    starts = strokes.means @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
    ends = starts + 0.01 * rotation_matrices(strokes.quats)[:, :, 0] @ camera.viewmat[:3, :3].T
    x, y = (ends[:, :2] / ends[:, 2:] - starts[:, :2] / starts[:, 2:]).T
    pairs = np.exp(2j * (np.arctan2(y, x) - np.radians(degrees))).mean()
    return abs(0.5 * np.angle(pairs, deg=True)), abs(pairs)


def painted(cameras, one, scene=None):
    scene = crate() if scene is None else scene
    stage = stage_of(scene, cameras)
    return stage, painted_stage(stage, Brushwork(manner=one, jitter=(0.0, 0.0)), cameras)


def test_the_map_lies_on_the_stage_with_its_top_at_the_top_of_the_picture():
    camera = frame_scene(plain_first_view(crate()), **SIZE)
    _, strokes = painted([camera], manner())
    frame = plain_views(strokes, [camera]).frames[0]
    picture = frame.rgb / np.maximum(frame.alpha, 1e-6)[..., None]
    assert frame.alpha.min() > 0.6
    blue = picture[..., 2] > picture[..., 0]
    assert blue[: SIZE["height"] // 5].mean() > 0.95
    assert blue[-SIZE["height"] // 8 :].mean() < 0.05


@for_each("degrees, least, most", [(0, 0.52, 0.68), (25, 0.35, 0.6), (50, 0.15, 0.4)])
def test_sky_keeps_its_share_of_the_painting_seen_level_and_some_of_it_seen_from_above(degrees, least, most):
    camera = frame_scene(plain_first_view(crate()), **SIZE, elevation=np.radians(degrees))
    _, strokes = painted([camera], manner())  # blue for 0.6 of its height
    frame = plain_views(strokes, [camera]).frames[0]
    assert least < (frame.rgb[..., 2] > frame.rgb[..., 0]).mean() < most


@for_each("degrees", [0, 30, 90, 150])
def test_marks_run_on_the_wall_as_they_appear_in_the_painting(degrees):
    camera = frame_scene(plain_first_view(crate()), **SIZE)
    stage, strokes = painted([camera], manner(angle=np.radians(degrees)))
    local = stage.place.local(strokes.means)
    rows = (local[:, 1] > 0.25 * stage.surface.wall) & (np.abs(local[:, 0]) < 0.2 * stage.surface.wall)
    assert rows.sum() > 20
    away, agreement = turned_by(strokes.take(rows), camera, degrees)
    assert away < 14
    assert agreement > 0.7


def test_strokes_differ_where_the_map_is_busy_and_hardly_where_it_is_calm():
    camera, g = frame_scene(plain_first_view(crate()), **SIZE), np.random.default_rng(0)
    colors = np.full((20, COLUMNS, 3), 0.5, np.float32)
    colors[:, COLUMNS // 2 :] += g.normal(0, 0.1, (20, COLUMNS - COLUMNS // 2, 1)).astype(np.float32)
    texels = np.full((2, 4, 8, 4), 128, np.uint8)
    texels[:, :, ::2, 0] += np.array([1, 30], np.uint8)[:, None, None]  # a calm mark and a busy one
    marks = MarkDictionary(np.full((2, 3), 0.5, np.float32), np.full(2, 0.5, np.float32), texels)
    part = Part(StyleStage(colors, np.zeros((20, COLUMNS, 2), np.float32)), 1, 0, marks)
    one = replace(manner(), parts=[part])
    stage = stage_of(crate(), [camera])
    layout = layout_of(stage.surface, stage.place, [camera], COLUMNS / 20)
    around = 2 * np.pi / layout.repeats * np.array([-0.25, -0.75])  # columns run against the turn
    along = np.full(2, stage.surface.length[-1] / 2)
    spots = Spots(np.zeros((2, 3)), around, along, np.ones(2), np.zeros((2, 7)))
    calm, busy = map_contrasts(one, places_on(layout, stage.surface, spots))
    assert calm < 0.2
    assert busy == pytest.approx(1)


@for_each("step", [-0.2, 0.2])
def test_black_and_white_stay_where_a_subject_gets_another_lightness(step):
    values = np.array([0.0, 0.2, 0.5, 0.8, 1.0])
    strokes = gaussians_at(np.zeros((5, 3)), 1, np.clip(rgb_of_oklab(np.outer(values, (1, 0, 0))), 0, 1))
    found = oklab_of(np.clip(base_colors(lightened(strokes, step).sh), 0, 1))[:, 0]
    np.testing.assert_allclose(found - values, step * np.array([0, 0.4, 1, 0.4, 0]), atol=2e-3)


@for_each("lightness", [0.1, 0.5, 0.9])
@for_each("apart", [0.0, 0.06])
@for_each("in_scene", [0.3, 0.7])
def test_a_subject_stands_out_by_its_lightness_and_a_stage_is_not_darkened(lightness, apart, in_scene):
    camera = frame_scene(plain_first_view(crate()), **SIZE)
    wall, own, plain = (
        tuple(np.clip(rgb_of_oklab(np.array([[at, 0.0, 0.0]]))[0], 0, 1))
        for at in (lightness, lightness + apart, in_scene)
    )
    _, behind = painted([camera], manner(top=wall, low=wall), crate(own))
    found = set_off(behind.astype(np.float32), crate(own), crate(plain), [camera])
    stage, within = (oklab_of(np.clip(base_colors(one.sh), 0, 1).astype(float))[:, 0].mean() for one in found)
    before = oklab_of(np.clip(base_colors(behind.sh), 0, 1))[:, 0].mean()
    assert abs(stage - within) > 0.14
    assert within > 0.35  # its form is not lost in black
    if 0.42 < within < 0.9:  # at the end of what is legible the stage gives the rest
        assert abs(stage - before) < 0.25 * abs(stage - within) + 0.02
    if within > stage and within < 0.9:  # what is the darker of both is not made darker still
        assert abs(stage - before) < 0.02
    if lightness == 0.5:  # either way is free
        assert (within > stage) == (in_scene > 0.5)
    again = set_off(*found, crate(plain), [camera])
    assert np.abs(base_colors(again[0].sh) - base_colors(found[0].sh)).max() < 0.03
