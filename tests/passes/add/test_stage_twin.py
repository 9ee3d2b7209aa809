"""Stages in the core against NumPy, for the still life and for strokes that no subject has."""

import numpy as np

import brushgs as bg
from brushgs.core.native import core as _core
from brushgs.passes.add.stage_place import lamp_direction
from brushgs.passes.extent import robust_frame
from brushgs.passes.reduce.contribution import paint_of
from brushgs.rendering.plain import plain_views
from brushgs.values.colors import CONES_FROM_RGB, OKLAB_FROM_ROOTS, oklab_of
from brushgs.values.quats import shortest_axes
from brushgs.values.sh import base_colors
from tests.kit.for_each import for_each
from tests.passes.add import stage_twin as twin
from tests.passes.add.test_stage import crate, plaza
from tests.passes.scenes import strange_strokes
from tests.scenes import still_life_of

SCENES = strange_strokes() | {
    "still life": still_life_of(3000),
    "on a plaza": crate() + plaza(),
    "crate": crate(),
}
LAMPS = [lamp_direction().tolist(), [0.99, 0.14, 0.0], [0.0, 1.0, 0.0]]
PROFILES = {  # radius, width, height, farthest, least_table
    "usual": (1.3, 0.9, 2.1, 6.0, 0.0),
    "of one point": (1e-9, 1e-10, 1e-10, 0.0, 0.0),
    "on a plaza": (1.0, 1.0, 1.0, 1.0, 40.0),
    "far away": (1.0, 1.0, 1.0, 1e6, 0.0),
    "slender": (1.0, 0.05, 900.0, 3.0, 0.0),
}


def check(name, *args, **options):
    """What the core finds, held to the twin."""
    found, expected = (getattr(module, name)(*args, **options) for module in (_core, twin))
    if expected is None:
        assert found is None
        return found
    found, expected = (each if isinstance(each, tuple) else (each,) for each in (found, expected))
    for one, other in zip(found, expected, strict=True):
        hold(one, other)
    return found


def hold(found, expected):
    expected = np.asarray(expected, np.float64).ravel()
    assert np.isfinite(expected).all()
    size = np.abs(expected).max(initial=0)
    np.testing.assert_allclose(np.asarray(found, np.float64).ravel(), expected, rtol=1e-9, atol=1e-12 * size)


def subject_of(name):
    """Points from the foot, up is -y in the world, paint, OKLab, radius and height."""
    scene = SCENES[name]
    center, radius = robust_frame(scene.means)
    points = np.ascontiguousarray((scene.means.astype(np.float64) - center) * (1, -1, 1))
    weights = np.ascontiguousarray(paint_of(scene), np.float64)
    middle, _, height = _core.find_standing(points, weights, radius)
    return points - middle, weights, oklab_of(base_colors(scene.sh[:, :1]).astype(np.float64)), radius, height


def spots(count):
    """Points, slopes, radians around, random numbers; the first on the axis, some far off."""
    rng = np.random.default_rng(2)
    points = rng.normal(size=(500, 3)) * (2, 0.5, 2)
    points[:4] = (0, 0, 0), (1e6, 0, 0), (0, 1e6, 0), (-2, -1e6, 3)
    around = np.arctan2(points[:, 2], points[:, 0])
    return points[:count], rng.uniform(-0.1, np.pi / 2, count), around[:count], rng.normal(size=count)


@for_each("shape", [(96, 96), (1, 1), (2, 300), (300, 1)])
@for_each("sigma", [0.01, 1.0, 30.0, 1e4])
def test_a_blurred_map_is_that_of_the_twin(shape, sigma):
    check("map_blurred", np.random.default_rng(1).normal(size=shape), sigma)


@for_each("count", [0, 1, 500])
@for_each("half", [1e-6, 1.5, 1e9])
def test_sums_and_samples_of_a_map_are_those_of_the_twin(count, half):
    level = np.ascontiguousarray(spots(count)[0][:, [0, 2]])
    values = np.random.default_rng(1).normal(size=(7, 7))
    check("map_sums", level, spots(count)[3], 7, half)
    check("map_samples", values, half, level)


@for_each("name", SCENES)
def test_the_place_of_a_subject_is_that_of_the_twin(name):
    points, weights, _, radius, _ = subject_of(name)
    if len(points):
        check("find_standing", points, weights, radius)
    else:
        assert _core.find_standing(points, weights, radius) == ([0, 0, 0], 0.05 * radius, 0.05 * radius)


@for_each("name", SCENES)
def test_the_ground_of_a_scene_is_that_of_the_twin_and_strokes_dissolve_as_there(name):
    points, weights, lab, radius, height = subject_of(name)
    normals = shortest_axes(SCENES[name].quats, SCENES[name].scales)
    for is_level in (np.abs(normals[:, 1]) > 0.85, np.ones(len(points), bool)):
        found = check("find_ground", points, is_level, weights, lab, radius, height)
        assert found is not None or name != "on a plaza"
        if found is not None:
            around = np.ascontiguousarray(points - (0, found[0], 0))
            check("dissolving_at", found[1].reshape(twin.SIDE, twin.SIDE), radius, around)


@for_each(
    "name", ["still life", "none", "one", "equal places", "a plane", "an outlier", "immense", "the largest"]
)
def test_the_shadow_of_a_subject_is_that_of_the_twin(name):
    points, weights, lab, radius, _ = subject_of(name)
    for lamp in LAMPS if name == "still life" else LAMPS[:1]:
        shade, contact, reflected = check("cast_shadow", points, weights, lab, radius, lamp)
        square = twin.SHADOW_SIDE, twin.SHADOW_SIDE
        maps = shade.reshape(square), contact.reshape(square), reflected.reshape(2, *square)
        for some in (points, radius * spots(500)[0]):
            check("shadow_at", *maps, radius, lamp, np.ascontiguousarray(some))


@for_each("name", PROFILES)
def test_surface_and_spots_are_those_of_the_twin(name):
    radius, width, height, farthest, least_table = PROFILES[name]
    options = {"radius": radius, "width": width}
    rho, heights, length, table, wall = check(
        "profile_around", **options, height=height, farthest=farthest, least_table=least_table
    )
    along = np.concatenate([length, length[-1] * np.linspace(-0.1, 1.1, 700)])
    check("profile_slopes", rho, heights, length, along)
    for distance in (0.0, 4 * radius):
        (sizes,) = check("stroke_sizes", rho, **options, distance=distance, seen_width=3 * radius)
    cells = sizes**2 * max(1.0, (2 * np.pi * rho * np.gradient(length) / sizes**2).sum() / 3000)
    for until in (-1.0, 0.5 * table, wall, np.inf):
        (count,) = check("count_spots", rho, length, cells, until)
    for num in (0, 1, count):
        noise = np.random.default_rng(3).normal(size=(num, _core.SPOT_NOISE))
        check("place_spots", rho, heights, length, cells, 0.35, noise)


@for_each("count", [0, 1, 500])
def test_colors_and_directions_are_those_of_the_twin(count):
    points, slopes, around, turns = spots(count)
    rng = np.random.default_rng(4)
    tones = {"table": [0.6, 0.02, 0.03], "wall": [0.4, -0.01, -0.02], "slope": 0.14, "reach": 2.5}
    for ground in (None, rng.normal(size=(count, 3))):
        check("surface_colors", points, slopes, **tones, ground_lab=ground, ground_extent=1.2)
    shades, shares, lab = rng.random((count, 4)), rng.random(count), rng.random((count, 3))
    changed = lab.copy()
    _core.shade_colors(shades, shares, changed)
    twin.shade_colors(shades, shares, lab)
    hold(changed, lab)
    waves = rng.normal(size=(2, _core.NUM_WAVES, 4))
    for is_still in (False, True):
        options = {"around": around, "turns": turns, "waves": waves, "radius": 1.7, "is_still": is_still}
        check("stage_frames", points, slopes, table=2.2, **options)


def outline_of(scene, above, own):
    """By a camera above the foot by so many radii."""
    center, radius = robust_frame(scene.means)
    away = radius * np.array([0.5, -above, -2.2])
    camera = bg.Camera.look_at(center + away, center, width=80, height=60)
    frame = plain_views(scene, [camera]).frames[0]
    return check(
        "outline_in",
        *(np.ascontiguousarray(plane, np.float64) for plane in (frame.rgb, frame.alpha)),
        K=np.ascontiguousarray(camera.K),
        rays=np.ascontiguousarray(camera.viewmat[:3, :3] * (1, -1, 1)),
        eye=((away - (0, 0.5 * radius, 0)) * (1, -1, 1)).tolist(),
        lengths=(3 * radius, 9 * radius, radius, own * radius),
        cones_from_rgb=CONES_FROM_RGB,
        lab_from_roots=OKLAB_FROM_ROOTS,
    )


def hold_tones(outline, is_table):
    for mean in ([0.5, 0.06, -0.03], [0.5, -0.02, 0.3], [0.2, 0.0, 0.0], [0.9, -1e-4, 1e-4]):
        for low, high, values in ((0.0, 1.0, 0.0), (0.6, 0.8, 0.5), (0.3, 0.46, 1.0)):
            for ground in (None, np.array([0.47, 0.01, 0.04])):
                options = {"mean": mean, "low": low, "high": high, "values": values}
                check("choose_tones", outline[0], is_table, outline[2], **options, ground=ground)
    check("tones_read", outline[0], is_table, outline[2], 0.45, 0.61)


@for_each("name", ["still life", "on a plaza", "crate", "none", "one", "a plane", "black", "loud"])
def test_outline_and_tones_are_those_of_the_twin(name):
    for above, own in ((0.0, 0.0), (0.8, 0.0), (0.8, 2.0), (9.0, 0.0)):
        outline = outline_of(SCENES[name], above, own)
        assert len(outline[0]) > 20 or name not in ("still life", "crate")
        hold_tones(outline, outline[1].astype(bool))


def test_tones_of_many_outlines_are_those_of_the_twin():
    rng = np.random.default_rng(5)
    for count in (0, 1, 40, 400):
        outline = rng.random(count), rng.random(count) < 0.4, rng.uniform(-1, 1, count)
        hold_tones(outline, outline[1])
