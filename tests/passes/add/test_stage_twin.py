"""Stages in the core against NumPy, for the still life and for strokes that no subject has."""

from functools import cache

import numpy as np

import brushgs as bg
from brushgs.core.native import core as _core
from brushgs.passes.add.stage_ground import Ground, dissolved
from brushgs.passes.add.stage_place import Place, lamp_direction
from brushgs.passes.add.stage_surface import Surface
from brushgs.passes.extent import robust_frame
from brushgs.values.colors import OKLAB
from brushgs.values.quats import rotation_matrices
from tests.kit.for_each import for_each
from tests.passes.add import stage_twin as twin
from tests.passes.add.test_stage import crate, plaza
from tests.passes.scenes import columns_of, random_gaussians, replaced, strange_strokes
from tests.scenes import still_life_of

SCENES = strange_strokes() | {"still life": still_life_of(3000), "on a plaza": crate() + plaza()}
STRANGE = ["none", "one", "equal places", "a plane", "an outlier", "immense", "the largest"]
LAMPS = [lamp_direction(), np.array([0.99, 0.14, 0.0]), np.array([0.0, 1.0, 0.0])]
AXES = np.diag([1.0, -1.0, 1.0])  # up is -y in the world
TURNED = rotation_matrices(np.array([[0.3, -0.5, 0.7, 0.2]]))[0] @ AXES


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


def site_of(name):
    """The place of a scene, and local points, paint and OKLab of it."""
    place, _, points, weights, lab = _core.find_site(*columns_of(SCENES[name]), AXES, LAMPS[0], OKLAB)
    return Place(*place), points.reshape(-1, 3), weights, lab.reshape(-1, 3)


def place_at(radius, axes=AXES):
    return Place(np.array([0.5, -2.0, 3.0]), axes, radius, 0.8 * radius, radius, LAMPS[0])


def surface_at(radius):
    return Surface(*_core.profile_around(place_at(radius), 5 * radius, 0.0))


def ground_at(radius):
    """A torn ground in many colors."""
    rng, side = np.random.default_rng(6), twin.SIDE
    coverage = twin.map_blurred((rng.random((side, side)) < 0.55) * 1.0, 3.0)
    colors, tone = rng.normal(0, 0.2, (3, side, side)), np.array([0.5, 0.01, 0.02])
    return place_at(radius), coverage, colors, tone, 1.2 * radius


@cache
def shadow_maps():
    rng, square = np.random.default_rng(7), (twin.SHADOW_SIDE, twin.SHADOW_SIDE)
    shade, contact = (twin.map_blurred(rng.random(square), 4.0) for _ in range(2))
    return np.maximum(3 * shade - 1.5, 0), 0.1 * contact, rng.normal(0, 0.1, (2, *square))


def spots(count, surface):
    """Spots; the first on the axis, some far off."""
    rng = np.random.default_rng(2)
    points = rng.normal(size=(500, 3)) * (2, 0.5, 2)
    points[:4] = (0, 0, 0), (1e6, 0, 0), (0, 1e6, 0), (-2, -1e6, 3)
    around = np.arctan2(points[:, 2], points[:, 0])
    along = surface.length[-1] * rng.uniform(-0.1, 1.1, 500)
    rest = along, rng.random(500), rng.normal(size=(500, _core.SPOT_NOISE))
    return tuple(column[:count].copy() for column in (points, around, *rest))


@for_each("count", [0, 1, 500])
@for_each("half", [1e-6, 1.5, 1e9])
def test_maps_are_those_of_the_twin(count, half):
    values, points = np.random.default_rng(1).normal(size=(96, 96)), spots(count, surface_at(1.0))[0]
    level = points[:, [0, 2]].copy()
    check("map_sums", level, points[:, 1].copy(), 7, half)
    check("map_samples", values, half, level)
    for some in (values, values[:1].copy(), values[:, :2].copy()):
        check("map_blurred", some, half)


@for_each("name", SCENES)
@for_each("dtype", [np.float32, np.float64])
def test_place_and_ground_of_a_scene_are_those_of_the_twin(name, dtype):
    if len(SCENES[name]) == 0:
        return
    columns = columns_of(SCENES[name].astype(dtype))
    for axes in (AXES, TURNED):
        site = check("find_site", *columns, axes, LAMPS[0], OKLAB)
    assert (site[1] is None) == (name != "on a plaza") or axes is TURNED
    if name != "still life":
        return
    many = [np.concatenate([column] * (120_000 // len(column) + 1)) for column in columns]
    assert len(check("find_site", *many, AXES, LAMPS[0], OKLAB)[3]) <= 40_000


def test_random_grounds_are_those_of_the_twin_and_strokes_dissolve_as_there():
    """Level paint of many extents and thicknesses, with paint above and below it."""
    num_found, count = 0, 1500
    for seed in range(40):
        rng = np.random.default_rng(seed)
        points, part = rng.uniform(-1, 1, (count, 3)), rng.dirichlet((4, 2, 2))
        heights = rng.normal(0, rng.uniform(0.01, 0.06), count), rng.uniform(0.05, 1, count)
        kind = rng.choice(3, count, p=part)
        points[:, 1] = np.choose(kind, (*heights, -rng.uniform(0, 0.5) * heights[1]))
        points[:, [0, 2]] *= np.where(kind == 1, rng.uniform(0.2, 1), rng.uniform(0.5, 2))[:, None]
        scales = np.sqrt(rng.uniform(0, 50 / count, (count, 1))) * (1, 1, 0.01)
        quats = np.where(rng.random((count, 1)) < 0.8, (1, 1, 0, 0), (1, 0, 0, 0)).astype(np.float64)
        scene = points @ AXES, quats, scales, np.ones(count), rng.normal(size=(count, 1, 3))
        found = check("find_site", *scene, AXES, LAMPS[0], OKLAB)[1]
        if found is not None:
            check_dissolved(points * (1.1, 1, 1.1), found[1])
            num_found += 1
    assert 10 < num_found < 35, num_found


def check_dissolved(points, coverage):
    """Strokes at local points, on a ground of this coverage, held to the twin."""
    place = place_at(1.0, TURNED)
    square = twin.SIDE, twin.SIDE
    ground = Ground(place, coverage.reshape(square), np.zeros((3, *square)), np.zeros(3), 1.0)
    for dtype, table in ((np.float32, np.array([0.4, 0.02, -0.3])), (np.float64, None)):
        strokes = replaced(random_gaussians(len(points), terms=4), means=place.world(points)).astype(dtype)
        found, opacities, sh = dissolved(strokes, ground, table), strokes.opacities.copy(), strokes.sh.copy()
        twin.dissolve(strokes.means, opacities, sh, ground, table, OKLAB)
        steps = 1e-6 if dtype == np.float32 else 1e-9
        np.testing.assert_allclose(found.opacities, opacities, rtol=steps, atol=steps)
        np.testing.assert_allclose(found.sh, sh, rtol=steps, atol=steps)


@for_each("name", [*STRANGE, "still life"])
def test_the_shadow_of_a_subject_is_that_of_the_twin(name):
    if len(SCENES[name]) == 0:
        return
    place, foot, weights, lab = site_of(name)
    radius = place.radius
    for lamp in LAMPS if name == "still life" else LAMPS[:1]:
        points = foot * (1, 10 if lamp[0] == 0 else 1, 1) - (0, 0.2 * radius, 0)  # and higher than all layers
        lit = place._replace(lamp=lamp)
        shade, contact, reflected = check("cast_shadow", points, weights, lab, lit)
        square = twin.SHADOW_SIDE, twin.SHADOW_SIDE
        maps = shade.reshape(square), contact.reshape(square), reflected.reshape(2, *square)
        for some in (points, radius * spots(500, surface_at(1.0))[0]):
            check("shadow_at", (lit, *maps), some)


@for_each(
    "radius, width, height", [(1.3, 0.9, 2.1), (1e-9, 1e-10, 1e-10), (1.0, 0.05, 900.0), (1.0, 2.0, 0.1)]
)
@for_each("farthest, extent", [(0.0, 0.0), (1e6, 0.0), (9.0, 0.0), (0.0, 40.0)])
def test_surface_and_spots_are_those_of_the_twin(radius, width, height, farthest, extent):
    place = place_at(radius)._replace(width=width, height=height)
    surface = check("profile_around", place, farthest, extent)
    rho, _, length, table, wall = surface
    along = np.concatenate([length, length[-1] * np.linspace(-0.1, 1.1, 700)])
    check("slopes_at", surface, along)
    for distance, seen in ((0.0, 3.0), (4 * radius, 0.5), (4 * radius, 3.0)):
        usual = check("stroke_sizes", surface, place, distance, seen * radius)
    few = max(1.0, (2 * np.pi * rho * np.gradient(length) / usual**2).sum() / 3000)
    sizes = usual * np.sqrt(9.6 * few)

    def draw(layer, count):
        return np.random.default_rng([3, layer]).normal(size=(count, _core.SPOT_NOISE))

    for until in (-1.0, 0.5 * table, wall, np.inf):
        check("place_spots", surface, sizes, 9.6, until, draw)
    for size in (0.6, 2.0):
        shadows = [(place_at(radius)._replace(lamp=lamp), *shadow_maps()) for lamp in LAMPS[:2]]
        for some in ([], shadows[:1], shadows):
            check("lay_layers", surface, 2 * sizes, size, radius, some, draw)
    check("size_beside", 1 + int(radius * 9000))


@for_each("count", [0, 1, 500])
@for_each("radius", [1.0, 1e-6])
def test_strokes_of_a_surface_are_those_of_the_twin(count, radius):
    surface, place, ground = surface_at(radius), place_at(radius, TURNED), ground_at(radius)
    points, *rest = spots(count, surface)
    all_spots, rng = (points * radius, *rest), np.random.default_rng(4)
    tones = np.array([0.6, 0.02, 0.03]), np.array([0.4, -0.01, -0.02]), 0.14, 0.0
    for own in (None, ground):
        lab = check("surface_colors", surface, all_spots, tones, own).reshape(-1, 3)
        for lamp in LAMPS[:2]:
            shadow, both = (place._replace(lamp=lamp), *shadow_maps()), (lab.copy(), lab.copy())
            _core.shade_colors(all_spots, shadow, 0.7, own, both[0])
            twin.shade_colors(all_spots, shadow, 0.7, own, both[1])
            hold(*both)
    waves = rng.normal(size=(2, _core.NUM_WAVES, 4))
    for is_still in (False, True):
        frames = check("stage_frames", surface, all_spots, waves, radius, is_still).reshape(-1, 3, 3)
    check("turned_quats", TURNED, frames)
    for contrast, longer in ((None, None), rng.random((2, count))):
        options = {"style": (2.4, 0.02, 0.01), "contrast": contrast, "longer": longer, "oklab": OKLAB}
        check("strokes_on", place, all_spots, frames, lab, **options)


@for_each("dtype", [np.float32, np.float64])
@for_each("height, width", [(1, 1), (1, 90), (60, 80), (81, 35)])
def test_borders_and_mean_colors_are_those_of_the_twin(dtype, height, width):
    rng = np.random.default_rng(8)
    check("border_alpha", rng.random((height, width)).astype(dtype))
    for weights in (np.zeros(height), rng.random(height)):
        check("mean_lab", rng.normal(size=(height, 4, 3)).astype(dtype), weights, OKLAB)


@for_each("name", [*STRANGE, "still life"])
@for_each("above, own", [(0.0, 0.0), (0.8, 0.0), (0.8, 2.0), (9.0, 0.0), (-0.55, 0.0)])
def test_an_outline_is_that_of_the_twin(name, above, own):
    """In the view of a camera that many radii above the middle, one of them level."""
    center, radius = robust_frame(SCENES[name].means)
    away = radius * np.array([0.5, -above, -2.2])
    camera = bg.Camera.look_at(center + away, center, width=80, height=60)
    frame = bg.plain_views(SCENES[name], [camera]).frames[0]
    found = check(
        "outline_in",
        *(np.ascontiguousarray(plane, np.float64) for plane in (frame.rgb, frame.alpha)),
        viewmat=camera.viewmat,
        K=camera.K,
        place=Place(np.add(center, (0, 0.5 * radius, 0)), AXES, radius, radius, radius, LAMPS[0]),
        surface=surface_at(radius)._replace(table=3 * radius, wall=9 * radius),
        ground_extent=own * radius / 1.5,
        oklab=OKLAB,
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
        check("choose_tones", outline, mean, low, high, ground, rng.random())
        check("tones_read", outline, *rng.random(2))
