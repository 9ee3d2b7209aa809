"""A lamp in the scene: where strokes face, what shades them, and their colors in its light."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import brushgs as bg
from brushgs.cameras.framing import plain_first_view
from brushgs.cameras.orbit import orbit
from brushgs.passes.add.stage import find_site
from brushgs.passes.add.stage_place import Place
from brushgs.passes.color.key_light import KeyLight
from brushgs.passes.color.key_normals import find_facing
from brushgs.passes.reduce.cluster import group
from brushgs.passes.reduce.merge import merge_clusters
from brushgs.still_life import still_life_camera
from brushgs.still_life.bodies import bodies
from brushgs.still_life.cast import blockers_of, cast_of, joined
from brushgs.still_life.light import TO_LAMP, baked
from brushgs.values.colors import oklab_of
from brushgs.values.quats import quats_of
from brushgs.values.sh import base_colors
from tests.passes.scenes import gaussians_at, on_sphere

# Azimuth from the viewer toward the right, and elevation, degrees: before the wall, which shades nothing.
LAMPS = [(-60, 40), (-30, 35), (0, 50), (30, 40), (60, 45), (-50, 65), (45, 65)]


def lamp_at(azimuth: float, elevation: float):
    turn, rise = np.radians((azimuth, elevation))
    return np.array([np.sin(turn) * np.cos(rise), -np.sin(rise), -np.cos(turn) * np.cos(rise)])


def front_views():
    """Cameras before the wall, which has but one side."""
    eyes = [(8 * np.sin(turn), -3.5, -8 * np.cos(turn)) for turn in np.linspace(-1.2, 1.2, 7)]
    return [bg.Camera.look_at(eye, (0.1, -1.2, 0.5), width=160, height=120) for eye in eyes]


def place_of(strokes: bg.Gaussians) -> Place:
    return find_site(strokes, plain_first_view(strokes)).place


def ball(count: int = 600, color=0.5, center=(0.0, 0.0, 0.0), radius: float = 1.0) -> bg.Gaussians:
    """Flat strokes on a sphere, of random turns and signs."""
    out = on_sphere(count)
    across = np.cross(out, np.random.default_rng(1).normal(size=(count, 3)))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    quats = quats_of(np.stack([across, np.cross(out, across), out], axis=2))
    sizes = 2.2 * radius / count**0.5 * np.array([1, 1, 0.05])
    return gaussians_at(center + radius * out, sizes, color, opacity=0.95, quats=quats, dtype=np.float32)


def views_around(strokes: bg.Gaussians):
    return orbit(plain_first_view(strokes), 6, width=120, height=90)


def lightness(strokes: bg.Gaussians):
    return oklab_of(base_colors(strokes.sh))[:, 0]


# Where strokes face


@pytest.mark.parametrize("is_seen", [True, False])
def test_a_ball_faces_outward(is_seen):
    strokes = ball()
    normals = find_facing(strokes, views_around(strokes) if is_seen else ()).normals
    assert (np.einsum("ki,ki->k", normals, strokes.means) > 0.95).all()


def test_a_ball_seen_from_its_middle_faces_inward():
    strokes = ball()
    cameras = [
        bg.Camera.look_at((0, 0, 0), side, width=96, height=96, fov_y=1.7, up=np.roll(side, 1))
        for side in (*np.eye(3), *-np.eye(3))
    ]
    assert np.mean(np.einsum("ki,ki->k", find_facing(strokes, cameras).normals, strokes.means) < -0.9) > 0.97


# The same strokes under other lamps


@pytest.fixture(scope="module")
def lit():
    """Lamps, and the strokes of the still life as if its own lamp had stood there."""
    rng = np.random.default_rng(0)
    parts = list(bodies(6000, rng))
    whole = joined([cast_of(body, number, rng) for number, body in enumerate(parts)])
    seen, blockers = whole.take(whole.opacities > 1 / 255), blockers_of(parts)
    lamps = [TO_LAMP, *(lamp_at(*angles) for angles in LAMPS)]
    scenes = [seen.gaussians(baked(seen.surface, blockers, lamp)) for lamp in lamps]
    labels = group(scenes[0], 2000).labels
    strokes = [merge_clusters(scene, labels) for scene in scenes]
    return lamps, [replace(one, sh=one.sh[:, :1]) for one in strokes]


@pytest.mark.parametrize("first", [0, 4])
def test_strokes_relit_from_one_lamp_to_seven_others_look_like_true_ones(lit, first):
    camera = still_life_camera(width=160, height=120)

    def picture(strokes):
        return np.clip(bg.render(strokes, camera, "flat", lock="off").over("black"), 0, 1)

    def psnr(one, other):
        return -10 * np.log10(((picture(one) - picture(other)) ** 2).mean())

    lamp, strokes = lit[0][first], lit[1][first]
    light = KeyLight.of(strokes, front_views(), place_of(strokes), lit_by=lamp)
    others = [pair for n, pair in enumerate(zip(*lit, strict=True)) if n != first]
    after = np.array([psnr(light.lit(other), true) for other, true in others])
    assert after.mean() >= 26
    assert after.min() >= 24
    assert (after > np.array([psnr(strokes, true) for _, true in others]) + 2).all()
    assert np.abs(light.colors(lamp) - base_colors(strokes.sh)).max() < 1e-6  # its own lamp


# A capture, whose light is unknown


@cache
def lit_ball(color: float = 0.5) -> KeyLight:
    strokes = ball(color=color)
    return KeyLight.of(strokes, views_around(strokes), place_of(strokes))


def test_lights_are_lighter_and_warmer_than_shade_and_the_mean_stays():
    light, lamp = lit_ball(), lamp_at(-40, 40)
    before, after = oklab_of(base_colors(light.strokes.sh)), oklab_of(light.colors(lamp))
    facing = light.strokes.means @ lamp
    lights, darks = after[facing > 0.7].mean(axis=0), after[facing < -0.3].mean(axis=0)
    assert lights[0] > darks[0] + 0.12
    assert lights[2] > darks[2] + 0.03
    assert np.abs((after - before).mean(axis=0)).max() < 0.01
    assert light.lit(lamp, 0.0) is light.strokes
    assert np.array_equal(light.colors(lamp, 0.0), base_colors(light.strokes.sh))
    zenith = [light.colors(lamp_at(azimuth, 89.5)) for azimuth in (0, 90, 180, 270)]  # no jump there
    assert max(np.abs(one - zenith[0]).max() for one in zenith) < 0.03


def test_a_scene_that_is_lit_already_is_not_lit_twice():
    light, lamp = lit_ball(), lamp_at(-40, 40)
    once = light.lit(lamp)
    again = KeyLight.of(once, views_around(once), light.place)
    gained, first = lightness(again.lit(lamp)).std() - lightness(once).std(), lightness(once).std()
    assert gained < 0.4 * first
    other = lamp_at(140, 40)
    shaded = once.means @ other > 0.7
    assert lightness(again.lit(other))[shaded].mean() > lightness(once)[shaded].mean() + 0.05


@pytest.mark.parametrize(("value", "low", "high"), [(0.97, 0.75, 0.99), (0.03, 0.005, 0.12)])
def test_white_does_not_burn_out_and_black_stays_readable(value, low, high):
    colors = lit_ball(value).colors(lamp_at(-40, 40))
    assert colors.min() > low
    assert oklab_of(colors)[:, 0].max() < 0.995
    assert colors.mean() < high


def test_a_body_shades_what_lies_behind_it():
    big, small = ball(900), ball(200, center=(2.2, 0.0, 0.0), radius=0.4)
    both = big + small
    light = KeyLight.of(both, views_around(both), place_of(both))
    behind, free = (light.key(np.array([x, 0.0, 0.0]))[900:] for x in (-1, 1))
    assert behind.max() < 0.35 * free.max()


def test_walls_keep_no_light_off_a_room():
    room, table = ball(1500), ball(300, radius=0.2)
    both = room + table
    inside = [bg.Camera.look_at((x, 0, 0), (-x, 0, 0), width=96, height=96, fov_y=2.0) for x in (0.6, -0.6)]
    lamp = np.array([0.6, -0.8, 0.0])
    outdoor, indoor = (
        KeyLight.of(both, inside, place_of(both), is_inside=is_inside).key(lamp)
        for is_inside in (False, True)
    )
    lit = table.means @ lamp > 0.15
    assert indoor[1500:][lit].mean() > 0.5
    assert outdoor[1500:][lit].mean() < 0.3
