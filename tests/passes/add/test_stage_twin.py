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

SCENES = strange_strokes() | {"still life": still_life_of(3000), "on a plaza": crate() + plaza()}
STRANGE = ["none", "one", "equal places", "a plane", "an outlier", "immense", "the largest"]
LAMPS = [lamp_direction().tolist(), [0.99, 0.14, 0.0], [0.0, 1.0, 0.0]]


def check(name, *args, **options):
    """What the core finds, held to the twin."""
    found, expected = (getattr(module, name)(*args, **options) for module in (_core, twin))
    hold(found, expected)
    return found


def hold(found, expected):
    if found is None or expected is None:
        assert found is expected
    elif isinstance(found, tuple):
        for one, other in zip(found, expected, strict=True):
            hold(one, other)
    else:
        found, expected = (np.asarray(each, np.float64).ravel() for each in (found, expected))
        assert np.isfinite(expected).all()
        size = np.abs(expected).max(initial=0)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12 * size)


def subject_of(name):
    """Points from the foot, up is -y in the world; paint, OKLab, radius and height."""
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


@for_each("count", [0, 1, 500])
@for_each("half", [1e-6, 1.5, 1e9])
def test_maps_are_those_of_the_twin(count, half):
    values, level = np.random.default_rng(1).normal(size=(96, 96)), spots(count)[0][:, [0, 2]].copy()
    check("map_sums", level, spots(count)[3], 7, half)
    check("map_samples", values, half, level)
    for some in (values, values[:1].copy(), values[:, :2].copy()):
        check("map_blurred", some, half)


@for_each("name", SCENES)
def test_place_and_ground_of_a_scene_are_those_of_the_twin(name):
    points, weights, lab, radius, height = subject_of(name)
    if len(points):
        check("find_standing", points, weights, radius)
    is_level = np.abs(shortest_axes(SCENES[name].quats, SCENES[name].scales)[:, 1]) > 0.85
    found = check("find_ground", points, is_level, weights, lab, radius, height)
    assert found is not None or name != "on a plaza"


def test_random_grounds_are_those_of_the_twin_and_strokes_dissolve_as_there():
    """Level paint of many extents and thicknesses, with paint above and below it."""
    num_found, count = 0, 1500
    for seed in range(80):
        rng = np.random.default_rng(seed)
        points, part = rng.uniform(-1, 1, (count, 3)), rng.dirichlet((4, 2, 2))
        heights = rng.normal(0, rng.uniform(0.01, 0.06), count), rng.uniform(0.05, 1, count)
        kind = rng.choice(3, count, p=part)
        points[:, 1] = np.choose(kind, (*heights, -heights[1]))
        points[:, [0, 2]] *= np.where(kind == 1, rng.uniform(0.2, 1), rng.uniform(0.5, 2))[:, None]
        weights, lab = rng.uniform(0, 20 / count, count), rng.random((count, 3))
        found = check("find_ground", points, weights > 4 / count, weights, lab, 1.0, rng.uniform(0.05, 1))
        if found is not None:
            check("dissolving_at", found[1].reshape(twin.SIDE, twin.SIDE), 1.0, points * (1.1, 1, 1.1))
            num_found += 1
    assert 20 < num_found < 70, num_found


@for_each("name", [*STRANGE, "still life"])
def test_the_shadow_of_a_subject_is_that_of_the_twin(name):
    foot, weights, lab, radius, _ = subject_of(name)
    for lamp in LAMPS if name == "still life" else LAMPS[:1]:
        points = foot * (1, 10 if lamp[0] == 0 else 1, 1) - (0, 0.2 * radius, 0)  # and higher than all layers
        shade, contact, reflected = check("cast_shadow", points, weights, lab, radius, lamp)
        square = twin.SHADOW_SIDE, twin.SHADOW_SIDE
        maps = shade.reshape(square), contact.reshape(square), reflected.reshape(2, *square)
        for some in (points, radius * spots(500)[0]):
            check("shadow_at", *maps, radius, lamp, some)


@for_each(
    "radius, width, height", [(1.3, 0.9, 2.1), (1e-9, 1e-10, 1e-10), (1.0, 0.05, 900.0), (1.0, 2.0, 0.1)]
)
@for_each("farthest, least_table", [(0.0, 0.0), (1e6, 0.0), (9.0, 0.0), (0.0, 40.0)])
def test_surface_and_spots_are_those_of_the_twin(radius, width, height, farthest, least_table):
    options = {"radius": radius, "width": width}
    rho, heights, length, table, wall = check(
        "profile_around", **options, height=height, farthest=farthest, least_table=least_table
    )
    along = np.concatenate([length, length[-1] * np.linspace(-0.1, 1.1, 700)])
    check("profile_slopes", rho, heights, length, along)
    for distance, seen in ((0.0, 3.0), (4 * radius, 0.5), (4 * radius, 3.0)):
        sizes = check("stroke_sizes", rho, **options, distance=distance, seen_width=seen * radius)
    cells = sizes**2 * max(1.0, (2 * np.pi * rho * np.gradient(length) / sizes**2).sum() / 3000)
    for until in (-1.0, 0.5 * table, wall, np.inf):
        count = check("count_spots", rho, length, cells, until)
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


@for_each("name", [*STRANGE, "still life"])
@for_each("above, own", [(0.0, 0.0), (0.8, 0.0), (0.8, 2.0), (9.0, 0.0), (-0.55, 0.0)])
def test_an_outline_is_that_of_the_twin(name, above, own):
    """In the view of a camera that many radii above the middle, one of them level."""
    center, radius = robust_frame(SCENES[name].means)
    away = radius * np.array([0.5, -above, -2.2])
    camera = bg.Camera.look_at(center + away, center, width=80, height=60)
    frame = plain_views(SCENES[name], [camera]).frames[0]
    found = check(
        "outline_in",
        *(np.ascontiguousarray(plane, np.float64) for plane in (frame.rgb, frame.alpha)),
        K=np.ascontiguousarray(camera.K),
        rays=np.ascontiguousarray(camera.viewmat[:3, :3] * (1, -1, 1)),
        eye=((away - (0, 0.5 * radius, 0)) * (1, -1, 1)).tolist(),
        lengths=(3 * radius, 9 * radius, radius, own * radius),
        cones_from_rgb=CONES_FROM_RGB,
        lab_from_roots=OKLAB_FROM_ROOTS,
    )
    assert len(found[0]) > 20 or name != "still life"


@for_each("low, high", [(0.0, 1.0), (0.6, 0.8), (0.3, 0.46)])
@for_each("ground", [None, np.array([0.47, 0.01, 0.04])])
def test_tones_are_those_of_the_twin(low, high, ground):
    rng = np.random.default_rng(5)
    for count in (0, 1, *rng.integers(2, 600, 80)):
        lightness = rng.normal(rng.uniform(0.2, 0.8), rng.uniform(0, 0.3), count)
        outline = lightness, rng.random(count) < rng.random(), rng.uniform(-1, 1, count)
        mean = [0.5, *rng.normal(0, 0.05, 2) * rng.choice([0, 0.02, 1])]
        check("choose_tones", *outline, mean=mean, low=low, high=high, ground=ground, values=rng.random())
        check("tones_read", *outline, *rng.random(2))
