"""Pictures of strokes that the page paints, against `render` in the order by depth."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.brushes.texture import Tint
from brushgs.pipeline.overpaint import coats_of_marks
from brushgs.rendering.canvas import Painting
from brushgs.rendering.relief import Relief
from brushgs.rendering.surface import linen
from brushgs.still_life import still_life_camera
from brushgs.values.marks import Marks
from tests.kit.for_each import for_each
from tests.outlets.page.strokes import CAMERAS, halved, hard_strokes
from tests.outlets.page.studio import painting_of
from tests.scenes import still_life_of

STEP = 4 / 255
SET = bg.BrushSet(tuple(bg.StrokeTexture.open(name) for name in ("flat", "line", "swirl")))


def assert_near(found, expected):
    """99 % of the pixels within 4/255, and at least 40 dB."""
    difference = np.abs(found - expected)
    assert (difference.max(axis=2) <= STEP).mean() >= 0.99
    assert 10 * np.log10(1 / np.square(difference).mean()) >= 40


def picture(frame):
    """[H, W, 4] color and alpha of a frame."""
    assert frame.alpha.mean() > 0.05
    return np.dstack([frame.rgb, frame.alpha])


def assert_same_picture(studio, painting, camera):
    """Color and alpha of the strokes alone."""
    studio.load(painting, camera)
    assert_near(studio.paint(camera), picture(painting.frame(camera)))


@pytest.fixture(scope="module")
def scene():
    """A still life of about 1000 Gaussians, in numbers that the page holds too."""
    strokes = still_life_of(1000)
    return replace(strokes, opacities=halved(strokes.opacities), sh=halved(strokes.sh))


@for_each(
    ("camera", "options"),
    [
        *((camera, {"underpaint": True}) for camera in CAMERAS),
        *((camera, {"streaks": 0.5, "lock": "off"}) for camera in CAMERAS[::2]),
    ],
)
def test_hard_strokes_from_five_cameras(studio, camera, options):
    strokes = hard_strokes(500, antialiased="underpaint" in options)
    camera = camera.resized(camera.width // 2, camera.height // 2)
    assert_same_picture(studio, painting_of(strokes, bg.StrokeTexture.open("flat"), **options), camera)


@for_each("options", [{}, {"underpaint": True, "streaks": 0.3}])
@for_each("is_colored", [False, True])
def test_several_brushes(studio, options, is_colored):
    """Two of three have colors of their own, or none."""
    textures = list(SET.textures)
    for row in (0, 2) if is_colored else ():
        coverage = textures[row].coverage
        textures[row] = replace(textures[row], tint=Tint.of(waves(*coverage.shape), coverage))
    strokes = hard_strokes(500, brushes=3, degree=1)
    assert_same_picture(studio, painting_of(strokes, bg.BrushSet(tuple(textures)), **options), CAMERAS[0])


def test_long_lines_of_a_pen_end_where_render_ends_them(studio):
    """Filtered images end softly: with the image itself in their place pixels are up to 0.49 off."""
    count, draw = 200, np.random.default_rng(0)
    scales = np.tile((1.0, 0.01, 0.001), (count, 1)) * draw.uniform(0.12, 0.25, (count, 1))
    quats = np.zeros((count, 4))
    quats[:, 0], quats[:, 3] = np.cos(turns := draw.uniform(0, np.pi, count)), np.sin(turns)
    means = draw.uniform(-1, 1, (count, 3)) * (1.5, 1, 0.1)
    columns = means, quats, scales, np.full(count, 0.99), np.full((count, 1, 3), -1.5)
    pen = bg.StrokeTexture("image", "pen", np.full((16, 64), 255, np.uint8))
    painting = painting_of(bg.Gaussians(*(column.astype(np.float32) for column in columns)), pen)
    studio.load(painting, CAMERAS[0])
    difference = studio.paint(CAMERAS[0]) - picture(painting.frame(CAMERAS[0]))
    assert np.abs(difference).max() < 0.1


def waves(height, width):
    """[H, W, 3] colors that wave along both sides."""
    v, u = np.mgrid[:height, :width] / max(height, width)
    return 0.5 + 0.5 * np.sin(9 * u[..., None] + 14 * v[..., None] + (0, 2, 4))


def test_normals_and_border(studio, scene):
    normals = np.random.default_rng(0).normal(size=(len(scene), 3))
    normals = halved(normals / np.linalg.norm(normals, axis=1, keepdims=True))
    camera = still_life_camera(width=320, height=240)
    for coat in ({"normals": normals}, {"normals": normals, "is_one_sided": True}, {"border": 0.13}):
        painting = painting_of(scene, bg.StrokeTexture.open("line"), coat=coat)
        assert_same_picture(studio, painting, camera)


def test_flat_pictures_lie_in_their_planes(studio):
    """From far away: the page has no perspective within one."""
    count, draw = 30, np.random.default_rng(0)
    v, u = np.mgrid[:24, :40] / 40
    soft = np.clip(8 * np.minimum(np.minimum(u, v), np.minimum(0.975 - u, 0.575 - v)), 0, 1)
    image = np.rint(255 * np.dstack([waves(24, 40), soft])).astype(np.uint8)
    directions = draw.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    toward = draw.normal((0, 0, -2), size=(count, 3))
    normals = toward - (toward * directions).sum(axis=1, keepdims=True) * directions
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    sides = draw.uniform(0.25, 0.5, (2, count))
    ones, tiles = np.ones(count), np.zeros(count, int)
    means = draw.uniform(-1, 1, (count, 3))
    marks = Marks(means, directions, normals, *sides, np.ones((count, 3)), ones, tiles, (image,))
    painting = Painting(tuple(coats_of_marks(marks, still_life_of(1000).take(np.zeros(0, int)))))
    for turn in np.radians((0, 25)):
        eye = (50 * np.sin(turn), 0, -50 * np.cos(turn))
        camera = bg.Camera.look_at(eye, (0, 0, 0), width=320, height=240, fov_y=0.06)
        studio.load(painting, camera)
        difference = studio.paint(camera) - picture(painting.frame(camera))
        # The renderer samples them twice: 41.4 and 41.7 dB.
        assert 10 * np.log10(1 / np.square(difference).mean()) >= 38


@for_each("copies", [60, 600])
def test_more_brushes_than_memory_has_room_for_blur_large_strokes_alone(studio, scene, copies):
    camera = still_life_camera(width=160, height=120)
    painting = painting_of(scene, bg.StrokeTexture.open("swirl"))
    studio.load(painting, camera, copies=copies)
    assert studio.page.evaluate("studio.painter.counts.atlasBytes") <= 2**26
    found, frame = studio.paint(camera), painting.frame(camera)
    difference = np.abs(found - picture(frame)).max(axis=2)
    assert (difference < 0.1).mean() > 0.95


@for_each("is_lit", [False, True])
def test_underpaint_as_a_layer_lies_below_all_strokes(studio, scene, is_lit):
    """Of all its pixels 59 dB and more to that order, of a sixteenth of them 47; among the strokes 29."""
    scene = scene.take(np.arange(0, len(scene), 5))  # with gaps
    camera, texture = still_life_camera(width=163, height=121), bg.StrokeTexture.open("impasto")
    more = {}
    if is_lit:
        board = linen((0.6, 0.5, 0.4), height=camera.height, width=camera.width)
        more = {"surface": board, "lamp": bg.Lamp(), "relief": Relief()}
    painting = painting_of(scene, texture, underpaint=True, **more)
    (coat,) = painting.coats
    assert coat.options.underpaint is not None
    soft = replace(scene, opacities=scene.opacities * np.float32(coat.options.underpaint.opacity))
    below = painting_of(soft, bg.StrokeTexture.open("gaussian")).coats[0]
    above = replace(coat, options=replace(coat.options, underpaint=None))
    layers = replace(painting, coats=(below, above))
    studio.load(painting, camera)
    pictures = [studio.paint(camera, ground=True, underpaintStep=step) for step in (0, 1, 4)]
    exact = picture(layers.frame(camera))
    among, whole, few = (10 * np.log10(1 / np.square(one - exact)[..., :3].mean()) for one in pictures)
    assert among < 35
    assert whole > 52
    assert few > 43


def test_underpaint_in_slabs_comes_near_the_order_of_render(studio, scene):
    """30.3 dB with one layer, 33.2 with four; 65.7 where each slab has one stroke or its underpaint."""
    camera = still_life_camera(width=163, height=121)
    painting = painting_of(scene, bg.StrokeTexture.open("impasto"), underpaint=True)
    studio.load(painting, camera)
    exact = picture(painting.frame(camera))
    one, four, many = (
        10 * np.log10(1 / np.square(studio.paint(camera, underpaintStep=1, numSlabs=count) - exact).mean())
        for count in (1, 4, 2 * len(scene))
    )
    assert four > one + 2
    assert many > 52
