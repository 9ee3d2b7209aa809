from dataclasses import replace

import numpy as np

import brushgs as bg
from brushgs.core.native import core as _core
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.rendering.options import RenderOptions, draw_with
from brushgs.rendering.relief import Relief
from brushgs.rendering.surface import Surface, paper
from brushgs.values.part import TILE
from brushgs.values.sh import in_colors
from tests.kit.for_each import for_each
from tests.passes.scenes import random_gaussians

CAMERA = bg.Camera.look_at((0, 0, -6), (0, 0, 0), width=96, height=72)
TEXTURE = bg.StrokeTexture.open("flat")
PLANES = "rgb", "alpha", "depth", "height"
OPTIONS = RenderOptions.of(TEXTURE, num_threads=1)


def strokes_at(depth, color, *, num=40, seed=0, opacity=0.8):
    """Strokes around the middle of the picture, so far behind the origin."""
    strokes = random_gaussians(num, seed, spread=0.4, size=0.2, dtype=np.float32)
    means = strokes.means * (1, 1, 0.05) + np.float32([0, 0, depth])
    opacities = np.full(num, opacity, np.float32)
    return in_colors(replace(strokes, means=means.astype(np.float32), opacities=opacities), color)


def coat(strokes, **fields):
    return Coat("test", strokes, TEXTURE, fields.pop("options", OPTIONS), **fields)


def surface_of(rgb=(0.9, 0.8, 0.7), **columns):
    shape = CAMERA.height, CAMERA.width
    bare = {"height": np.zeros(shape, np.float32), "grain": np.ones(shape, np.float32)}
    return Surface(np.broadcast_to(np.float32(rgb), (*shape, 3)).copy(), **(bare | columns))


def test_one_coat_without_a_surface_is_what_render_draws():
    strokes = strokes_at(0, (0.8, 0.2, 0.1))
    _, expected = draw_with(strokes, CAMERA, TEXTURE, OPTIONS)
    frame = Painting((coat(strokes),)).frame(CAMERA)
    for name in ("rgb", "alpha", "depth"):
        np.testing.assert_array_equal(getattr(frame, name), getattr(expected, name))


def test_a_surface_makes_the_picture_opaque_unless_strokes_are_to_stand_alone():
    strokes, surface = strokes_at(0, (0.8, 0.2, 0.1)), surface_of()
    _, alone = draw_with(strokes, CAMERA, TEXTURE, OPTIONS)
    frame = Painting((coat(strokes),), surface).frame(CAMERA)
    assert (frame.alpha == 1).all()
    np.testing.assert_allclose(frame.rgb, alone.rgb + (1 - alone.alpha)[..., None] * surface.rgb, atol=1e-6)
    transparent = Painting((coat(strokes),), surface, is_transparent=True).frame(CAMERA)
    np.testing.assert_array_equal(transparent.alpha, alone.alpha)
    np.testing.assert_array_equal(transparent.rgb, alone.rgb)


def test_light_changes_the_picture_only_where_there_is_height():
    strokes = strokes_at(0, (0.8, 0.2, 0.1))
    surface = paper((0.9, 0.8, 0.7), height=72, width=96, strength=3)
    unlit = Painting((coat(strokes),), surface).frame(CAMERA)
    lit = Painting((coat(strokes),), surface, bg.Lamp()).frame(CAMERA)
    assert lit.height is not None
    bare = unlit.rgb[:8, :8], lit.rgb[:8, :8]  # of the paper alone
    assert np.abs(bare[1] - bare[0]).max() > 0.005
    board = Painting((coat(strokes),), surface_of(), bg.Lamp()).frame(CAMERA)
    np.testing.assert_array_equal(board.rgb, Painting((coat(strokes),), surface_of()).frame(CAMERA).rgb)


@for_each("dtype", [np.float32, np.float64])
@for_each("num_threads", [1, 3])
def test_coats_are_composed_as_numpy_does(dtype, num_threads):
    g = np.random.default_rng(0)
    shape = (150, 240)  # several pieces of work
    shapes = {name: (*shape, 3) if name == "rgb" else shape for name in PLANES}
    front, back = ({name: g.random(size).astype(dtype) for name, size in shapes.items()} for _ in range(2))
    front["alpha"][:20] = back["alpha"][:10] = 0
    passed = 1 - front["alpha"]
    behind = back["alpha"] * passed
    alpha = behind + front["alpha"]
    depth = back["depth"] * behind + front["alpha"] * front["depth"]
    expected = {
        "rgb": back["rgb"] * passed[..., None] + front["rgb"],
        "alpha": alpha,
        "depth": np.divide(depth, alpha, out=depth, where=alpha > 0),
        "height": back["height"] * (1 - dtype(0.3) * front["alpha"]) + front["height"],
    }
    ground, tint = (g.random((*shape, 3)).astype(dtype) for _ in range(2))
    picture, height = np.empty_like(ground), np.empty_like(alpha)
    of_front = {"alpha": front["alpha"], "num_threads": num_threads}
    _core.lay_on_ground(rgb=front["rgb"], ground=ground, tint=tint, picture=picture, **of_front)
    np.testing.assert_array_equal(picture, passed[..., None] * ground * tint + front["rgb"])
    _core.raise_ground(ground=behind, paint=front["height"], hidden=0.3, height=height, **of_front)
    raised = (1 - dtype(0.3) * front["alpha"]) * behind + front["height"]
    np.testing.assert_array_equal(height, raised, strict=True)
    below = {f"below_{name}": plane for name, plane in back.items()}
    _core.lay_over(**front, **below, hidden=0.3, num_threads=num_threads)
    for name in PLANES:
        np.testing.assert_array_equal(back[name], expected[name], strict=True)


def relief_coat(depth, seed, opacity=0.8):
    strokes = strokes_at(depth, (0.8, 0.2, 0.1), num=400, seed=seed, opacity=opacity)
    return coat(strokes, options=replace(OPTIONS, relief=Relief()))


def test_only_while_the_camera_moves_paint_hides_the_height_below_it():
    above, below = relief_coat(-1, 1, opacity=0.99), relief_coat(1, 2)
    canvas = surface_of(height=np.random.default_rng(0).uniform(0, 1, (72, 96)).astype(np.float32))
    for coats, surface in (((below, above), surface_of()), ((above,), canvas)):
        still = Painting(coats, surface, bg.Lamp())
        heights = {}
        for is_moving in (False, True):
            whole = replace(still, is_moving=is_moving).frame(CAMERA)
            alone = Painting((above,), surface_of(), bg.Lamp(), is_moving=is_moving).frame(CAMERA)
            heights[is_moving] = np.abs(whole.height - alone.height)
        is_covered = replace(still, coats=(above,), surface=None).frame(CAMERA).alpha > 0.98
        assert is_covered.sum() > 200
        of_still, of_moving = (heights[is_moving][is_covered].mean() for is_moving in (False, True))
        assert of_still > 0.02
        assert of_moving < 0.05 * of_still


def as_laid(coats, method):
    """The planes of coats that a method of a canvas lays, and those of the lowest of them alone."""
    canvas = Painting(coats, is_moving=True).with_depth(True).canvas(CAMERA)
    lowest = canvas.lay(coats[0], coats[0].boxes(CAMERA)[0])
    lowest = replace(lowest, **{name: getattr(lowest, name).copy() for name in PLANES})
    for one in coats[1:]:
        getattr(canvas, method)(one, one.boxes(CAMERA)[0])
    return canvas._frame, lowest


@for_each("order", ["depth", "soft"])
def test_coats_laid_as_they_are_painted_are_those_laid_afterwards(order):
    of_coats = replace(OPTIONS, order=order, relief=Relief())
    wide = random_gaussians(300, 5, spread=1.5, size=0.3, dtype=np.float32)
    stage = coat(wide, options=of_coats)
    right = np.float32((2.5, 0, 0))
    red, blue = strokes_at(0, (0.8, 0.2, 0.1), num=400), strokes_at(-0.5, (0.1, 0.2, 0.9), seed=2)
    subject = coat(replace(red, means=red.means + right), options=of_coats)
    accents = coat(replace(blue, means=blue.means + right), options=of_coats, tolerance=1.6)
    afterwards, lowest = as_laid((stage, subject, accents), "lay")
    at_once, _ = as_laid((stage, subject, accents), "lay_within")
    for name in ("rgb", "alpha", "height"):
        np.testing.assert_array_equal(getattr(at_once, name), getattr(afterwards, name))
    np.testing.assert_allclose(at_once.depth, afterwards.depth, rtol=1e-6)
    strokes = Painting((subject, replace(accents, tolerance=None))).frame(CAMERA).alpha
    bare = next(
        tile
        for left in range(0, CAMERA.width, TILE[0])
        for top in range(0, CAMERA.height, TILE[1])
        if not strokes[tile := (slice(top, top + TILE[1]), slice(left, left + TILE[0]))].any()
    )
    assert (lowest.alpha[bare] > 0).any()
    for name in PLANES:
        np.testing.assert_array_equal(getattr(at_once, name)[bare], getattr(lowest, name)[bare])
