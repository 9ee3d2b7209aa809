"""Layers for compositing: what a picture is made of, pixel by pixel."""

from dataclasses import is_dataclass, replace
from functools import lru_cache

import numpy as np
import pytest

import brushgs as bg
from brushgs.options.choices import LAYERS
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.rendering import marks as marks_of_view
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.rendering.motion import AT_REST, SHIFT, Pose
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.wanted import Following, Wanted
from brushgs.still_life import still_life_camera
from brushgs.values.layers import Matte
from brushgs.values.quats import quat_products
from tests.kit import blind, for_each, still_life_of
from tests.passes.scenes import gaussians_at, random_gaussians

CAMERA = bg.Camera.look_at((0.3, -0.8, -6), (0, 0, 0), width=96, height=72)
FLAT = bg.StrokeTexture.open("flat")
OPTIONS = RenderOptions.of(FLAT, low_pass=0.0)
ALL = Wanted((*LAYERS,), deep=True)
LOOKS = "plain", "oil", "charcoal", "ink", "watercolour"


def strokes_of(num=150, seed=0, **columns):
    strokes = random_gaussians(num, seed, spread=0.9, size=0.15, dtype=np.float32)
    return replace(strokes, **columns)


def painting_of(strokes, options=OPTIONS, texture=FLAT):
    return Painting((Coat("strokes", strokes, texture, options),))


@lru_cache
def look_of(name):
    """The painting of a look in the still life, and its camera."""
    config, camera = blind(name, 300, (80, 60)), still_life_camera(width=80, height=60)
    prepared = prepare(still_life_of(2000), config, Report(), views=camera)
    return prepared.painting, prepared.cameras[0]


def flattened(deep):
    """Color and alpha of samples laid over each other, front to back."""
    pixels = deep.height * deep.width
    rgb, light = np.zeros((pixels, 3)), np.ones(pixels)
    counts = np.diff(deep.starts)
    for rank in range(counts.max()):
        has = counts > rank
        i = deep.starts[:-1][has] + rank
        rgb[has] += light[has, None] * deep.colors[i]
        light[has] *= 1 - deep.alphas[i].astype(np.float64)
    shape = deep.height, deep.width
    return rgb.reshape(*shape, 3), 1 - light.reshape(shape)


# Mattes


@for_each("look", LOOKS)
def test_mattes_of_each_medium_sum_to_what_is_painted(look):
    painting, camera = look_of(look)
    frame = painting.frame(camera, wanted=ALL)
    covering = tuple(coat for coat in painting.coats if coat.blend == "cover")
    strokes = replace(painting, surface=None, lamp=None, coats=covering)
    for name in ("stroke", "brush", "layer"):
        matte = frame.layers[name]
        total = matte.coverage.sum(axis=2)
        assert (np.diff(matte.coverage, axis=2) <= 0).all()
        assert ((matte.rows >= 0) == (matte.coverage > 0)).mean() > 0.999
        assert matte.rows.max() < len(matte.names)
        if name == "layer":
            np.testing.assert_allclose(total, frame.alpha, atol=1 / 255)
    if not any(coat.dry for coat in painting.coats):
        alpha = strokes.frame(camera).alpha
        for name in ("stroke", "brush"):
            np.testing.assert_allclose(frame.layers[name].coverage.sum(axis=2), alpha, atol=1 / 255)
    if painting.surface is not None:
        assert "ground" in frame.layers["layer"].names


def test_a_matte_says_which_stroke_covers_a_pixel():
    """Two strokes side by side and one behind both."""
    means, scales = [(-1, 0, 0), (1, 0, 0), (0, 0, 1)], [(0.4, 0.4, 0.1), (0.4, 0.4, 0.1), (1.5, 0.3, 0.1)]
    strokes = gaussians_at(means, scales, opacity=1)
    strokes = replace(strokes, brushes=np.uint8([0, 1, 0]), regions=np.uint8([0, 2, 1]))
    camera = bg.Camera.look_at((0, 0, -6), (0, 0, 0), width=96, height=72)
    options = RenderOptions.of(bg.StrokeTexture.open("ellipse"))
    painting = replace(painting_of(strokes, options, bg.StrokeTexture.open("ellipse")), region_names=("sky",))
    layers = painting.frame(camera, wanted=Wanted(("stroke", "id"))).layers
    left, right, between = (36, 36), (36, 60), (36, 48)
    names = {place: name_at(layers["stroke"], place) for place in (left, right, between)}
    assert names == {left: "strokes_0", right: "strokes_1", between: "strokes_2"}
    assert [name_at(layers["region"], p) for p in (left, right, between)] == ["elsewhere", "region 2", "sky"]
    assert layers["layer"].names == ("strokes",)
    assert layers["brush"].names == ("ellipse",)
    assert layers["stroke"].coverage[left][0] == pytest.approx(0.99)
    assert layers["stroke"].rows[0, 0, 0] == -1


def test_mattes_name_coats_of_one_name_and_plain_gaussians():
    strokes = bg.Gaussians([[-1, 0, 0]], [[1, 0, 0, 0]], [[0.4, 0.4, 0.1]], [1.0], [[[0, 0, 0]]])
    first, second = (Coat("strokes", replace(strokes, means=[[x, 0, 0]]), FLAT, OPTIONS) for x in (-1, 0))
    painting = Painting((first, second.showing(replace(strokes, means=[[1, 0, 0]]))))
    layers = painting.frame(CAMERA, wanted=Wanted(("stroke", "id"))).layers
    assert layers["stroke"].names == ("strokes_0", "strokes2_0", "scene")


def name_at(matte: Matte, place):
    return matte.names[matte.rows[place][0]]


# Motion and place


def moved_cameras():
    turned = np.deg2rad(3)
    orbit = bg.Camera.look_at((0.6, -0.75, -5.9), (0.05, 0, 0), width=96, height=72)
    roll = np.eye(4)
    roll[:2, :2] = [[np.cos(turned), -np.sin(turned)], [np.sin(turned), np.cos(turned)]]
    zoomed = CAMERA.K * [[1.1], [1.1], [1]]
    zoomed[:2, 2] = CAMERA.K[:2, 2]
    rolled, closer = replace(CAMERA, viewmat=roll @ CAMERA.viewmat), replace(CAMERA, K=zoomed)
    return {"orbit": orbit, "roll": rolled, "zoom": closer, "still": CAMERA}


def uv_in(boxes, rows, points):
    """Places of points in boxes, 0 to 1."""
    c, s = np.cos(boxes.angles[rows]), np.sin(boxes.angles[rows])
    x, y = (points - boxes.centers[rows]).T
    places = np.stack([c * x + s * y, c * y - s * x], axis=1) / boxes.half_extents[rows]
    return (1 + places) / 2


@for_each("underpaint", [False, True])
@for_each("move", moved_cameras())
def test_motion_leads_to_the_same_place_of_the_same_stroke(move, underpaint):
    camera, strokes = moved_cameras()[move], strokes_of(ids=np.arange(150, dtype=np.int32))
    options = RenderOptions.of(FLAT, underpaint=underpaint, order="soft")
    numbers = np.tile(np.float32(AT_REST), (50, 1))
    generator = np.random.default_rng(0)
    numbers[:, SHIFT] = generator.normal(0, 0.03, (50, 3))
    numbers[:, 3:7] += generator.normal(0, 0.05, (50, 4))
    numbers[:, 7] = 0.05
    pose = Pose(np.arange(0, 100, 2, dtype=np.int32), strokes.means[:100:2].astype(np.float64), numbers)
    now = painting_of(strokes, options)
    following = Following(now.posed(pose).coats, camera)
    layers = now.frame(CAMERA, wanted=Wanted(("uv", "motion", "stroke"), following=following)).layers
    boxes, _ = following.coats[0].boxes(camera)
    row_of = np.full(150, -1)
    row_of[boxes.ids] = np.arange(len(boxes))
    matte, uv = layers["stroke"], layers["uv"]
    shown = np.array([-1 if name == "scene" else int(name.split("_")[1]) for name in matte.names])
    y, x = np.nonzero(matte.rows[..., 0] >= 0)
    rows = row_of[shown[matte.rows[y, x, 0]]]
    is_sure = matte.coverage[y, x, 0] > (matte.coverage[y, x, 1] + 1e-5 if matte.rows.shape[2] > 1 else 0)
    inside = ((uv[y, x] > 0) & (uv[y, x] < 1)).all(axis=1) & (rows >= 0) & is_sure
    assert inside.sum() > 1500
    y, x, rows = y[inside], x[inside], rows[inside]
    there = np.stack([x + 0.5, y + 0.5], axis=1) + layers["motion"][y, x]
    off = (uv_in(boxes, rows, there) - uv[y, x]) * 2 * boxes.half_extents[rows]
    assert np.abs(off).max() < 0.01
    if move == "still":
        assert np.abs(layers["motion"]).max() > 1


def test_round_kernels_do_not_spin_where_their_axes_change_places():
    """A Gaussian that is hardly longer than wide, and then hardly wider than long."""
    kernel = bg.StrokeTexture.open("gaussian")
    options = RenderOptions.of(kernel)
    places = {"means": np.zeros((1, 3), np.float32), "quats": np.float32([[1, 0, 0, 0]])}
    places["opacities"] = np.ones(1, np.float32)
    scales = np.float32([[0.500, 0.499, 0.1]]), np.float32([[0.499, 0.500, 0.1]])
    now, then = (painting_of(strokes_of(1, scales=one, **places), options, kernel) for one in scales)
    camera = bg.Camera.look_at((0, 0, -6), (0, 0, 0), width=96, height=72)
    assert abs(np.subtract(*(p.coats[0].boxes(camera)[0].angles[0] for p in (now, then)))) > 1
    frame = now.frame(camera, wanted=Wanted(("motion",), following=Following(then.coats, camera)))
    assert np.abs(frame.layers["motion"]).max() < 0.1


# Normals


def test_normals_are_those_of_the_planes_toward_the_camera():
    tilt = np.float32([np.cos(0.3), np.sin(0.3), 0, 0])  # 0.6 radians around x
    scales = np.tile(np.float32([0.3, 0.2, 0.01]), (40, 1))
    strokes = strokes_of(40, quats=np.tile(tilt, (40, 1)), scales=scales)
    camera = bg.Camera.look_at((0, 0, -6), (0, 0, 0), (0, -1, 0), width=96, height=72)
    frame = painting_of(strokes).frame(camera, wanted=Wanted(("normal",)))
    expected = camera.viewmat[:3, :3] @ [0, np.sin(0.6), -np.cos(0.6)]
    assert expected[2] < 0
    is_painted = frame.alpha > 0
    assert is_painted.sum() > 500
    off = np.abs(frame.layers["normal"][is_painted] - expected)
    assert off.max() < 1e-5
    assert (frame.layers["normal"][~is_painted] == 0).all()
    quats = quat_products(strokes.quats, np.float32([[0, 1, 0, 0]])).astype(np.float32)
    flipped = replace(strokes, quats=quats)
    again = painting_of(flipped).frame(camera, wanted=Wanted(("normal",)))
    np.testing.assert_allclose(again.layers["normal"], frame.layers["normal"], atol=1e-5)
    shown = Coat("strokes", strokes.take(slice(20)), FLAT, OPTIONS).showing(strokes.take(slice(20, 40)))
    among = Painting((shown,)).frame(camera, wanted=Wanted(("normal",)))
    assert np.abs(among.layers["normal"][among.alpha > 0] - expected).max() < 1e-5


# Deep samples


def assert_flattens_to(frame):
    rgb, alpha = flattened(frame.deep)
    np.testing.assert_allclose(rgb, frame.rgb, atol=1e-5)
    np.testing.assert_allclose(alpha, frame.alpha, atol=1e-5)


@for_each("is_transparent", [False, True])
@for_each("look", LOOKS)
def test_deep_samples_laid_over_each_other_are_the_picture(look, is_transparent):
    painting, camera = look_of(look)
    painting = replace(painting, is_transparent=is_transparent)
    frame = painting.frame(camera, wanted=Wanted(deep=True))
    assert_flattens_to(frame)
    pixels = np.repeat(np.arange(80 * 60), np.diff(frame.deep.starts))
    assert (np.diff(frame.deep.depths)[np.diff(pixels) == 0] >= 0).all()
    assert np.isfinite(frame.deep.depths).all()
    assert (frame.deep.depths > 0).all()
    if painting.surface is not None and not is_transparent:
        last = frame.deep.starts[1:] - 1
        assert (frame.deep.ids[last] == 0).all()
        assert (frame.deep.alphas[last] == 1).all()
        assert frame.deep.depths[last].min() > np.delete(frame.deep.depths, last).max()
    elif not any(coat.blend == "glaze" for coat in painting.coats):
        assert (frame.deep.ids > 0).all()


def test_deep_samples_of_a_soft_order_with_underpaint_are_the_picture():
    options = RenderOptions.of(FLAT, order="soft", underpaint=True, streaks=0.3)
    frame = painting_of(strokes_of(), options).frame(CAMERA, wanted=Wanted(deep=True))
    assert_flattens_to(frame)
    assert set(np.unique(frame.deep.ids)) <= set(range(1, 151))


# Height, light, and what is not asked for


def test_height_and_unlit_are_those_of_the_canvas():
    painting, camera = look_of("impressionist")
    lit = painting.frame(camera, wanted=Wanted(("height", "unlit", "depth")))
    unlit = replace(painting, lamp=None).frame(camera)
    np.testing.assert_array_equal(lit.layers["unlit"][..., :3], unlit.rgb)
    np.testing.assert_array_equal(lit.layers["unlit"][..., 3], unlit.alpha)
    np.testing.assert_array_equal(lit.layers["height"], lit.height)
    assert np.abs(lit.layers["unlit"][..., :3] - lit.rgb).max() > 0.01
    assert (lit.layers["depth"] > 0).any()


@for_each("look", LOOKS)
def test_what_is_wanted_changes_no_bit_of_the_picture(look):
    painting, camera = look_of(look)
    alone, with_all = painting.frame(camera), painting.frame(camera, wanted=ALL)
    for name in ("rgb", "alpha", "depth", "height"):
        np.testing.assert_array_equal(getattr(alone, name), getattr(with_all, name))
    assert alone.layers == {}
    assert alone.deep is None


def test_neither_bands_nor_threads_change_a_bit_of_a_layer(monkeypatch):
    strokes = strokes_of()
    camera = bg.Camera.look_at((0.3, -0.8, -6), (0, 0, 0), width=200, height=170)

    def frame(num_threads):
        options = RenderOptions.of(FLAT, order="soft", num_threads=num_threads)
        painting = painting_of(strokes, options)
        following = Following(painting.coats, CAMERA)
        return painting.frame(camera, wanted=replace(ALL, following=following))

    once = frame(1)
    monkeypatch.setattr(marks_of_view, "MOST_FRAGMENTS", 1)
    monkeypatch.setattr(marks_of_view, "FIRST_ROWS", 16)
    again = frame(3)
    parts, others = (one.layers | {"deep": one.deep} for one in (once, again))
    assert parts.keys() == others.keys()
    for name, part in parts.items():
        pair = (vars(one) if is_dataclass(one) else one for one in (part, others[name]))
        np.testing.assert_equal(*pair, err_msg=name)


def test_render_gives_the_layers_that_are_named():
    strokes = strokes_of()
    names = ("depth", "normal", "motion", "uv", "stroke", "height")
    frame = bg.render(
        strokes, CAMERA, "flat", relief=True, layers=names, next_camera=moved_cameras()["orbit"]
    )
    assert set(frame.layers) == {*names, "paint"}
    assert frame.layers["motion"].shape == (72, 96, 2)
    np.testing.assert_array_equal(frame.rgb, bg.render(strokes, CAMERA, "flat", relief=True).rgb)
    with pytest.raises(ValueError, match=r"layers must be names out of depth, .* got 'speed'"):
        bg.render(strokes, CAMERA, "flat", layers=("speed",))


def test_a_painting_without_strokes_has_empty_layers():
    painting = painting_of(strokes_of(3).take(slice(0)))
    frame = painting.frame(CAMERA, wanted=replace(ALL, following=Following(painting.coats, CAMERA)))
    assert frame.layers["stroke"].names == ()
    assert (frame.layers["motion"] == 0).all()
    assert len(frame.deep.ids) == 0
