"""The stage around a subject: what it is made of, whatever the scene."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.cameras.framing import frame_scene, plain_first_view
from brushgs.cameras.orbit import orbit
from brushgs.first_view import find_first_view
from brushgs.passes.add.cut_in import cut_in
from brushgs.passes.add.stage import find_site, open_stage
from brushgs.passes.add.stage_ground import BAND, dissolved
from brushgs.passes.add.stage_marks import HATCHING, WASH, shadow_marks, table_edge
from brushgs.passes.add.stage_paint import Brushwork, painted_stage
from brushgs.passes.add.stage_place import lamp_direction
from brushgs.passes.add.stage_tones import READS, Outline, choose_tones
from brushgs.rendering.facing import BEHIND, facing_shares
from brushgs.values.colors import oklab_of
from brushgs.values.sh import C0, base_colors
from tests.kit.for_each import for_each
from tests.passes.scenes import gaussians_at, rescaled

SIZE = {"width": 160, "height": 120}
UP = np.array([0.0, -1.0, 0.0])


def box(low, high, color, count: int = 1500, seed: int = 0) -> bg.Gaussians:
    """Flat Gaussians on the six faces of a box; colors are display-encoded, one or [count, 3]."""
    g = np.random.default_rng(seed)
    low, high = np.asarray(low, float), np.asarray(high, float)
    sizes = high - low
    areas = np.array([sizes[1] * sizes[2], sizes[0] * sizes[2], sizes[0] * sizes[1]])
    axis = g.choice(3, count, p=areas / areas.sum())
    means = low + g.random((count, 3)) * sizes
    rows = np.arange(count)
    means[rows, axis] = np.where(g.random(count) < 0.5, low[axis], high[axis])
    size = 1.2 * np.sqrt(2 * areas.sum() / count)
    scales = np.full((count, 3), 0.5 * size)
    scales[rows, axis] = 0.01 * size
    return gaussians_at(means, scales, color, opacity=0.95, dtype=np.float32)


def crate(color=(0.3, 0.32, 0.3), lift: float = 0.0) -> bg.Gaussians:
    """A crate whose foot is at y = -lift, up is -y."""
    return box((-0.5, -1.2 - lift, -0.4), (0.5, -lift, 0.4), color)


def plaza(color=(0.55, 0.5, 0.45), reach: float = 1.6) -> bg.Gaussians:
    """Level ground at y = 0 around the origin."""
    return box((-reach, 0.0, -reach), (reach, 0.004, reach), color, count=6000, seed=3)


def stage_of(scene: bg.Gaussians, cameras=None, **options):
    view = plain_first_view(scene)
    return open_stage(find_site(scene, view), scene, cameras or [frame_scene(view, **SIZE)], **options)


# The surface


def test_all_cameras_stand_inside_and_the_table_at_the_foot():
    scene = crate()
    cameras = orbit(plain_first_view(scene), 6, **SIZE)
    stage = stage_of(scene, cameras)
    assert stage.place.foot[1] == pytest.approx(0.0, abs=0.02)
    for camera in cameras:
        right, height, away = stage.place.local(camera.position[None])[0]
        rho = np.hypot(right, away)
        assert rho < stage.surface.wall
        assert height > np.interp(rho, stage.surface.rho, stage.surface.height)


def test_every_pixel_of_an_orbit_is_covered_by_paint():
    scene = crate()
    cameras = orbit(plain_first_view(scene), 5, **SIZE)
    strokes = painted_stage(stage_of(scene, cameras), Brushwork(), cameras)
    for frame in bg.plain_views(strokes, cameras).frames:
        assert frame.alpha.min() > 0.85


@for_each("unit", [1e-6, 1e6])
def test_a_stage_does_not_depend_on_the_unit_of_the_scene(unit):
    scene = crate()
    frames = []
    for each in (scene, rescaled(scene, unit)):
        camera = frame_scene(plain_first_view(each), **SIZE)
        frames.append(
            bg.plain_views(painted_stage(stage_of(each, [camera]), Brushwork(), [camera]), [camera]).frames[0]
        )
    # In float32 a place may fall on the other side of the edge of the shadow, and have another stroke.
    assert np.abs(frames[1].rgb - frames[0].rgb).mean() < 1e-3


@for_each("count", [1, 2, 40])
def test_a_handful_of_gaussians_has_a_stage_of_finite_strokes(count):
    scene = crate().take(slice(count))
    view = find_first_view(scene)
    camera = frame_scene(view, **SIZE)
    stage = open_stage(find_site(scene, view), scene, [camera])
    for strokes in (
        painted_stage(stage, Brushwork(), [camera]),
        shadow_marks(stage.place, stage.shadow, [camera], WASH),
        table_edge(stage.place, stage.surface, [camera]),
    ):
        assert all(np.isfinite(column).all() for column in (strokes.means, strokes.scales, strokes.sh))


# Shadow and ground


def test_the_shadow_falls_away_from_the_lamp_and_strength_0_has_none():
    scene = crate((0.8, 0.8, 0.8))
    camera = frame_scene(plain_first_view(scene), **SIZE)
    stage = stage_of(scene, [camera])
    lit, dark = (
        painted_stage(stage, Brushwork(shadow=share, jitter=(0, 0)), [camera]) for share in (0.0, 1.0)
    )
    at = np.array([[0.55, 0, 0.4], [-0.55, 0, -0.4], [0.0, 0, -3.0]]) * stage.place.radius
    shade = stage.shadow.at(at)[:, 0]
    assert shade[0] > 0.4 > 0.1 > shade[1]
    assert shade[2] < 0.02
    low = [oklab_of(base_colors(one.sh))[:, 0].min() for one in (lit, dark)]
    assert 0.15 < low[1] < low[0] - 0.1  # never black


def test_the_table_continues_the_ground_that_a_scene_brings():
    color = np.array([0.55, 0.5, 0.45])
    scene = crate() + plaza(color)
    stage = stage_of(scene)
    assert stage.ground is not None
    assert stage.place.foot[1] == pytest.approx(0.0, abs=0.03)
    lab = oklab_of(color[None])[0]
    np.testing.assert_allclose(stage.tones.table[0], lab[0], atol=0.03)
    assert stage_of(crate()).ground is None


def test_a_torn_ground_dissolves_toward_its_border_and_what_hangs_below_is_gone():
    fringe = box((-1.6, 0.2, -1.6), (1.6, 0.4, -1.5), (1.0, 1.0, 1.0), count=300, seed=5)
    scene = bg.Gaussians.joined([crate(), plaza(), fringe])
    stage = stage_of(scene)
    assert stage.ground is not None
    table = np.array([0.3, 0.0, 0.0])
    mended = dissolved(scene, stage.ground, table)
    heights = stage.place.local(scene.means)[:, 1] / stage.place.radius
    assert not mended.opacities[heights < -1.01 * BAND].any()
    standing = heights > 1.5 * BAND
    np.testing.assert_array_equal(mended.sh[standing], scene.sh[standing])
    rho = np.abs(scene.means[:, [0, 2]]).max(axis=1)
    light = oklab_of(base_colors(mended.sh))[:, 0]
    on_ground = np.abs(heights) < 0.5 * BAND
    before = oklab_of(base_colors(scene.sh))[on_ground, 0].mean()
    assert light[on_ground & (rho < 1.0)].mean() == pytest.approx(before, abs=0.02)
    assert light[on_ground & (rho > 1.55)].mean() < before - 0.1


@for_each("azimuth", [20, 250])
def test_the_lamp_follows_shadows_that_the_scene_shows(azimuth):
    turn = np.radians(azimuth)
    lamp = lamp_direction((np.cos(turn), 0.9, np.sin(turn)))
    bare = plaza()
    stage = stage_of(crate() + bare)
    assert not stage.follows_light
    painted = stage.place._replace(lamp=lamp)
    from brushgs.passes.add.stage_shadow import cast_shadow

    points, weights, lab = painted.local(crate().means), np.full(len(crate()), 0.01), np.zeros((1500, 3))
    shade = cast_shadow(points, weights, lab, painted).at(painted.local(bare.means))[:, 0]
    colors = base_colors(bare.sh) * (1 - 0.6 * np.clip(shade, 0, 1))[:, None]
    shadowed = replace(bare, sh=((colors - 0.5) / C0)[:, None].astype(np.float32))
    found = stage_of(crate() + shadowed)
    assert found.follows_light
    level = found.place.lamp[[0, 2]] / np.linalg.norm(found.place.lamp[[0, 2]])
    assert level @ (np.cos(turn), np.sin(turn)) > np.cos(np.radians(35))  # lamps are tried every 20 degrees


# Tones


@for_each("lightness", np.linspace(0.1, 0.95, 8))
def test_a_subject_of_any_lightness_reads(lightness):
    n = 200
    outline = Outline(np.full(n, lightness), np.arange(n) < 80, np.linspace(-1, 1, n))
    tones = choose_tones(np.array([lightness, 0.05, 0.02]), outline)
    assert tones.reads > 0.99
    assert abs(tones.wall[0] - lightness) >= READS
    warm = [color @ (0, 0.3, 1.0) for color in (tones.table, tones.wall)]
    assert (warm[0] > 0) != (warm[1] > 0)  # one is warm, the other cool


def test_the_table_fades_from_below_and_the_wall_does_not():
    scene = crate()
    view = plain_first_view(scene)
    camera = frame_scene(view, **SIZE)
    stage = stage_of(scene, [camera])
    strokes = painted_stage(stage, Brushwork(), [camera])
    normals = stage.normals_of(strokes)
    on_table = np.hypot(*stage.place.local(strokes.means)[:, [0, 2]].T) < 0.5 * stage.surface.table
    on_wall = ~normals.any(axis=1)
    shares = []
    for elevation in np.radians([20, 0.5, -1.5, -3, -4.5, -30]):
        eye = stage.place.foot + 4 * (np.cos(elevation) * np.array([0, 0, -1.0]) + np.sin(elevation) * UP)
        seen = bg.Camera.look_at(tuple(eye), tuple(stage.place.foot), up=tuple(UP), **SIZE)
        share = facing_shares(strokes.means, normals, seen, is_one_sided=True)
        assert (share[on_wall] == 1).all()
        shares.append(share[on_table].mean())
    assert shares[0] == 1
    assert shares[-1] == 0
    assert (np.diff(shares) <= 0).all()
    assert max(-np.diff(shares)) < 0.75  # by degrees, not at once
    assert pytest.approx(np.sin(np.radians(5)), abs=1e-3) == BEHIND[1]


def test_edges_are_cut_in_along_the_outline_in_the_colors_behind_it():
    scene = crate((0.9, 0.2, 0.2))
    view = plain_first_view(scene)
    camera = frame_scene(view, **SIZE)
    behind = painted_stage(stage_of(scene, [camera]), Brushwork(), [camera])
    strokes = cut_in(scene, behind, camera)
    assert len(strokes) > 5
    wanted = {tuple(c) for c in np.round(base_colors(strokes.sh), 1)}
    assert not any(red > 0.8 and green < 0.3 for red, green, _ in wanted)
    before, after = (
        bg.plain_views(s, [camera]).frames[0].alpha > 0.5 for s in (scene, strokes.astype(np.float32))
    )
    overlap = (before & after).sum() / after.sum()
    assert 0.02 < overlap < 0.5
    same = replace(scene, sh=np.full_like(scene.sh, (0.5 - 0.5) / C0))
    wall = replace(behind, sh=np.full_like(behind.sh, (0.52 - 0.5) / C0))
    assert len(cut_in(same, wall, camera)) == 0  # a lost edge stays lost


# What is seen of it


def test_hatching_lies_in_the_shadow_and_is_crossed_where_it_is_dark():
    stage = stage_of(crate())
    camera = frame_scene(plain_first_view(crate()), **SIZE)
    marks = shadow_marks(stage.place, stage.shadow, [camera], HATCHING)
    shades = stage.shadow.at(stage.place.local(marks.means))
    assert (shades[:, :2].max(axis=1) > 0.05).all()
    assert len(marks) > 1.1 * len(
        shadow_marks(stage.place, stage.shadow, [camera], replace(HATCHING, is_crossed=False))
    )
