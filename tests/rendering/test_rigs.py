"""Spheres and eyes: strokes, light and layers as for one camera, without seams."""

from dataclasses import replace
from math import pi, radians

import numpy as np
import pytest

import brushgs as bg
from brushgs.options.projection import ProjectionConfig
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.relief import Relief
from brushgs.rendering.rigs import Rig, directions_between
from brushgs.rendering.sphere import Sphere, lit_all_around, sphere_of
from brushgs.rendering.wanted import Following, Wanted
from tests.kit import for_each, still_life_of
from tests.passes.scenes import random_gaussians

FLAT = bg.StrokeTexture.open("flat")
WIDTH = 256
EQUIRECT = Rig(ProjectionConfig(projection="equirect"))
CAMERA = bg.Camera.look_at((0, 0, 0), (0.3, 0.1, 1), width=WIDTH, height=WIDTH // 2)
SIDE = Rig(ProjectionConfig(stereo="side"), 0.2)


def strokes_around(num=1500, radius=3.0, seed=0):
    """Strokes on a sphere around the origin, along its surface."""
    strokes = random_gaussians(num, seed, spread=1.0, size=0.05, dtype=np.float32)
    means = strokes.means / np.linalg.norm(strokes.means, axis=1, keepdims=True) * np.float32(radius)
    scales = np.clip(2 * strokes.scales, 0.08, 0.24)  # some pixels of the picture, and no more than a face
    opacities = np.full(num, 0.9, np.float32)
    return replace(strokes, means=means.astype(np.float32), scales=scales, opacities=opacities)


def painting_of(strokes=None, *, rig=EQUIRECT, lamp=None, **options):
    relief = None if lamp is None else Relief()
    options = RenderOptions.of(FLAT, relief=relief, **options)
    coat = Coat("strokes", strokes_around() if strokes is None else strokes, FLAT, options)
    return Painting((coat,), rig=rig, lamp=lamp)


def turned(camera, angle):
    """The camera turned to the right in place."""
    cos, sin = np.cos(angle), np.sin(angle)
    turn = np.eye(4)
    turn[:3, :3] = (cos, 0, -sin), (0, 1, 0), (sin, 0, cos)
    return replace(camera, viewmat=turn @ camera.viewmat)


@for_each("lamp", [None, bg.Lamp(), bg.Lamp(towards=(0.6, -0.64, 0.48))])
@for_each("quarters", [1, 2])
def test_the_seam_is_as_any_other_column(quarters, lamp):
    painting = painting_of(lamp=lamp)
    cameras = CAMERA, turned(CAMERA, quarters * pi / 2)
    there, here = (painting.frame(camera).over("white") for camera in cameras)
    moved = np.roll(there, -quarters * WIDTH // 4, axis=1)
    assert np.ptp(there) > 0.5
    assert np.abs(moved - here).max() <= 2 / 255


def test_views_of_a_cube_agree_with_the_sphere():
    strokes = still_life_of(6000)
    strokes = replace(strokes, scales=np.minimum(strokes.scales, 0.08))  # none as large as a face
    painting = painting_of(strokes)
    camera = bg.Camera.look_at((0.5, -2.5, -4.5), (2.0, -2.5, 0), width=1024, height=512)
    picture = painting.frame(camera).over("white")
    sphere, errors = sphere_of(EQUIRECT.projection, camera), []
    for face, turn in zip(sphere.faces(camera), sphere.turns, strict=True):
        side = 2 * round(sphere.focal)
        K = np.array([[side / 2, 0, side / 2], [0, side / 2, side / 2], [0, 0, 1]])
        view = replace(painting, rig=None).frame(replace(face, K=K, width=side, height=side)).over("white")
        errors.append(np.mean((smaller(view) - smaller(seen_in(picture, turn, side))) ** 2))
    assert -10 * np.log10(np.mean(errors)) >= 40


def seen_in(picture, turn, side):
    """A perspective view of 90 degrees, looked up in a sphere."""
    from scipy.ndimage import map_coordinates

    place = (np.arange(side) + 0.5) / side * 2 - 1
    rays = np.stack([*np.meshgrid(place, place), np.ones((side, side))], axis=2) @ turn
    x, y, z = np.moveaxis(rays / np.linalg.norm(rays, axis=2, keepdims=True), 2, 0)
    height, width = picture.shape[:2]
    row = (0.5 + np.arcsin(y) / pi) * height - 0.5
    column = (0.5 + np.arctan2(x, z) / (2 * pi)) * width - 0.5
    around = np.pad(picture, ((0, 0), (2, 2), (0, 0)), mode="wrap")
    channels = [map_coordinates(around[..., c], (row, column + 2), order=1, mode="nearest") for c in range(3)]
    return np.stack(channels, axis=2)


def smaller(picture, step=8):
    """The picture at the resolution that a sphere has: faces are sharper, towards their borders most."""
    side = len(picture) // step
    return picture[: step * side, : step * side].reshape(side, step, side, step, 3).mean(axis=(1, 3))


def test_depth_is_the_distance_and_normals_are_in_the_axes_of_the_camera():
    strokes = strokes_around(radius=3.0)
    wanted = Wanted(("depth", "normal"))
    frame = painting_of(strokes).frame(CAMERA, wanted=wanted)
    painted = frame.alpha > 0.99
    assert painted.mean() > 0.05
    away = frame.layers["depth"][painted]
    assert np.median(away) == pytest.approx(3.0, rel=0.05)
    assert (np.abs(away - 3) < 0.4).mean() > 0.95  # of a whole stroke it is that of its middle
    front = replace(painting_of(strokes), rig=None).frame(
        bg.Camera(CAMERA.viewmat, np.array([[64, 0, 32], [0, 64, 32], [0, 0, 1.0]]), 64, 64), wanted=wanted
    )
    ahead = frame.layers["normal"][60:68, 124:132].reshape(-1, 3)
    there = front.layers["normal"][28:36, 28:36].reshape(-1, 3)
    means = [one[np.linalg.norm(one, axis=1) > 0.5].mean(axis=0) for one in (ahead, there)]
    assert np.linalg.norm(means[0] - means[1]) < 0.25
    lengths = np.linalg.norm(frame.layers["normal"], axis=2)
    assert (np.isclose(lengths, 1, atol=1e-3) | (lengths < 1e-3)).mean() > 0.99


def bumps(side=64):
    height = np.random.default_rng(0).random((side, side)).astype(np.float32)
    return bg.Frame(
        np.full((side, side, 3), 0.5, np.float32), np.ones((side, side), np.float32), height=height
    )


def test_light_of_level_faces_is_that_of_a_picture_and_turns_on_the_others():
    frame, lamp, sphere = bumps(), bg.Lamp(), Sphere(WIDTH, WIDTH // 2, 2 * pi)
    K = np.array([[32.0, 0, 32], [0, 32, 32], [0, 0, 1]])
    up = next(turn for turn in sphere.turns if turn[2, 1] == -1)
    face = bg.Camera(np.eye(4), K, 64, 64)
    level = lit_all_around(frame, lamp, face, np.array([0.0, 1, 0]), is_moving=False)
    np.testing.assert_array_equal(level, bg.light(frame.rgb, frame.height, lamp, alpha=frame.alpha))
    above = lit_all_around(frame, lamp, face, up[:, 1], is_moving=False)
    # Below the middle of the face that looks up, down is down in the picture; above it, the other way round.
    for rows, turn in ((slice(48, 62), 0.0), (slice(2, 16), pi)):
        one = bg.light(frame.rgb, frame.height, replace(lamp, azimuth=lamp.azimuth + turn), alpha=frame.alpha)
        difference = np.abs(above[rows, 30:34] - one[rows, 30:34]).mean()
        other = bg.light(
            frame.rgb, frame.height, replace(lamp, azimuth=lamp.azimuth + turn + pi), alpha=frame.alpha
        )
        assert difference < 0.25 * np.abs(above[rows, 30:34] - other[rows, 30:34]).mean()


@for_each("rig", [SIDE, Rig(ProjectionConfig(stereo="top"), 0.2)])
def test_eyes_are_parallel_and_half_the_distance_to_each_side(rig):
    camera = bg.Camera.look_at((1, -1, -4), (0, 0, 0), width=96, height=64)
    left, right = rig.eyes(camera)
    np.testing.assert_allclose(right.position - left.position, 0.2 * camera.viewmat[0, :3], atol=1e-12)
    np.testing.assert_allclose((right.position + left.position) / 2, camera.position, atol=1e-12)
    np.testing.assert_array_equal(left.viewmat[:3, :3], camera.viewmat[:3, :3])
    painting = painting_of(rig=rig)
    frame, width, height = painting.frame(camera), *rig.size_of(camera)
    assert frame.alpha.shape == (height, width)
    first, second = np.split(frame.rgb, 2, axis=0 if height == 128 else 1)
    for eye, picture in ((left, first), (right, second)):
        alone = replace(painting, rig=None).frame(eye, directions_between(painting.coats, camera))
        np.testing.assert_array_equal(picture, alone.rgb)


@for_each("lock", ["anchor", "canonical"])
def test_strokes_point_alike_in_both_eyes(lock):
    from brushgs.rendering.canonical import fit_canonical

    strokes = random_gaussians(2000, 3, spread=1.0, size=0.1, dtype=np.float32)
    coat = Coat("strokes", strokes, FLAT, RenderOptions.of(FLAT, lock=lock))
    if lock == "canonical":
        coat = replace(coat, fields=fit_canonical(strokes))
    camera = bg.Camera.look_at((0, -1, -4), (0, 0, 0), width=96, height=64)
    eyes = SIDE.eyes(camera)
    locks = None, directions_between([coat], camera)[0]
    alone, locked = (most_turn(coat, eyes, directions) for directions in locks)
    assert alone > radians(45)  # the scene has strokes that would turn
    assert locked < radians(1)


def most_turn(coat, eyes, directions):
    angles = np.full((2, len(coat.strokes)), np.nan)
    for row, eye in zip(angles, eyes, strict=True):
        boxes, _ = coat.boxes(eye, directions)
        row[boxes.ids] = boxes.angles
    return np.nanmax(np.abs((angles[0] - angles[1] + pi) % (2 * pi) - pi))


def test_half_spheres_of_two_eyes_lie_side_by_side():
    camera = replace(CAMERA, width=96, height=96)
    rig = Rig(ProjectionConfig(stereo="vr180"), 0.2)
    picture = painting_of(rig=rig).frame(camera).over("white")
    assert picture.shape == (96, 192, 3)
    whole = painting_of().frame(replace(camera, width=192, height=96)).over("white")
    one = replace(rig, ipd=1e-9)
    left, right = np.split(painting_of(rig=one).frame(camera).over("white"), 2, axis=1)
    np.testing.assert_allclose(left, right, atol=1e-3)
    assert np.abs(left - whole[:, 48:144]).mean() < 0.02
    assert np.abs(np.diff(np.split(picture, 2, axis=1), axis=0)).mean() > 0.02


def test_layers_of_eyes_lie_as_their_pictures_and_motion_is_that_of_each_eye():
    camera = bg.Camera.look_at((0, 0, -1), (0, 0, 2), width=48, height=32)
    painting = painting_of(rig=SIDE)
    following = Following(painting.coats, turned(camera, 0.02))
    frame = painting.frame(camera, wanted=Wanted(("depth", "motion"), following=following))
    assert frame.layers["motion"].shape == (32, 96, 2)
    assert frame.layers["depth"].shape == (32, 96)
    left, right = np.split(frame.layers["motion"][..., 0], 2, axis=1)
    seen = [np.median(one[one != 0]) for one in (left, right)]
    assert seen[0] == pytest.approx(seen[1], rel=0.1)
    assert abs(seen[0]) > 0.2
