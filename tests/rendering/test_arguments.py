"""What rendering refuses, in which words; poisoned columns; constants shared with the core."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from brushgs.brushes.texture import StrokeTexture, strokes_folder
from brushgs.rendering import constants
from brushgs.rendering.border import thin_to_border
from brushgs.rendering.depth_test import DepthTest
from brushgs.rendering.light import Lamp, light
from brushgs.rendering.project import project
from brushgs.rendering.rasterize import rasterize
from brushgs.rendering.relief import Relief
from brushgs.rendering.render import render, render_sequence
from brushgs.rendering.surface import flat
from brushgs.rendering.tooth import press
from brushgs.rendering.underpaint import Underpaint
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from tests.kit.for_each import for_each
from tests.rendering.paintings import BRUSHES, SOLID, UNDERPAINT, painting_of, set_back
from tests.rendering.strokes import boxes_of, bristles, random_boxes

TEXTURE = StrokeTexture.open("ellipse")
BOXES = boxes_of([[5, 5], [9, 9]], 3)
DEEP = set_back(BOXES, 1.0)
CAMERA = Camera.look_at((0, 0, -3), (0, 0, 0), width=20, height=10)
SCENE = Gaussians(np.zeros((2, 3)), np.ones((2, 4)), np.ones((2, 3)), np.ones(2), np.zeros((2, 1, 3)))
ODD, SEEN, THREE = replace(SCENE, brushes=[0, 9]), project(SCENE, CAMERA), BRUSHES["three"]
BAD_NUMBERS = [np.nan, np.inf, -np.inf]
MANY = replace(random_boxes(9, 20, 20), brushes=np.array([0, 1, 2, 0, 3, 0, 1, 2, 9], np.uint8))
FRAME = Frame(np.zeros((4, 5, 3)), np.zeros((4, 5)), np.zeros((4, 5)))


def draw(boxes=BOXES, texture=SOLID, **options):
    return rasterize(boxes, texture, **{"height": 10, "width": 10} | options)


def held_to(limit, tolerance):
    return lambda: draw(in_front_of=DepthTest(limit, np.array(tolerance)))


def each(call, values, sentence):
    """A row for each of some values."""
    return [(partial(call, value), sentence) for value in values]


NOT_POSITIVE, NEGATIVE, NOT_A_SHARE = (0, -1, np.inf, np.nan), (-0.1, np.inf, np.nan), (-0.1, 1.1, np.nan)
VALUES = [  # what is called, and the sentence of the ValueError
    (lambda: draw(filter="cubic"), "rasterize: filter must be one of mip, bilinear, nearest, got 'cubic'"),
    (lambda: draw(filter=None), "rasterize: filter must be one of .*, got None"),
    (lambda: draw(height=0), "rasterize: height must be in 1 to 32767 pixels, got 0"),
    *each(lambda v: draw(width=v), (-4, 32768), "rasterize: width must be in 1 to 32767 pixels, got"),
    (lambda: draw(width=30000, height=30000), "width x height must be at most 268435456 pixels, got 30000"),
    (lambda: draw(num_threads=0), "num_threads must be in 1 to 1024, got 0"),
    *each(lambda v: draw(min_transmittance=v), (-1e-9, 1.0, np.nan), "min_transmittance must be in"),
    *each(lambda v: draw(streaks=v), (*NOT_A_SHARE, 0.51), "rasterize: streaks must be in 0 to 0.5, got"),
    (lambda: draw(underpaint=UNDERPAINT), "boxes must have setbacks .* project with underpaint=True"),
    (lambda: draw(relief=True), "boxes must have reliefs .* project with relief=True"),
    (lambda: draw(DEEP, blend="glaze", underpaint=UNDERPAINT), "a glaze has no underpaint"),
    (lambda: draw(blend="glaze", streaks=0.1), r"a glaze has no streaks, got 0\.1"),
    (lambda: draw(blend="add"), "blend must be one of cover, glaze, got 'add'"),
    (lambda: draw(MANY, THREE), "brushes must be rows of the brush set, .* got row 9, first .* at 4"),
    (lambda: draw(MANY, SOLID), "which has 1 brush, got row 9"),
    (held_to(np.array([[1.0, np.nan]]), [1, 1]), "limit must not be NaN"),
    *each(lambda v: DepthTest(FRAME.alpha, np.array([v])), NEGATIVE, "tolerance must be finite and >= 0"),
    (held_to(np.ones((10, 7)), [1, 1]), r"limit of in_front_of must have shape \[10, 10\], got \[10, 7\]"),
    (held_to(np.ones((10, 10)), [1.0]), r"tolerance of in_front_of must have shape \[2\], got \[1\]"),
    (lambda: DepthTest.by_picture(replace(FRAME, depth=None), SEEN, SCENE), "must have a depth"),
    *each(Underpaint, NOT_POSITIVE, "Underpaint: reach must be positive"),
    *each(lambda v: Underpaint(1, v), (0, *NOT_A_SHARE), "Underpaint: opacity must be above 0 to 1"),
    *each(lambda v: Relief(thickness=v), NEGATIVE, "Relief: thickness must be >= 0 and finite"),
    *each(lambda v: Relief(gain=v), NEGATIVE, "Relief: gain must be >= 0 and finite, got"),
    *each(lambda v: Relief(by_light=v), NOT_A_SHARE, "Relief: by_light must be 0 to 1, got"),
    *each(lambda v: Relief(lights=v), ((0.2, 1.1), (0.6, 0.4)), "Relief: lights must be 0 to 1 and ascend"),
    *each(lambda v: project(SCENE, CAMERA, num_sigmas=v), NOT_POSITIVE, "num_sigmas must be positive and"),
    (lambda: project(SCENE, CAMERA, num_sigmas=np.ones(4)), "one for each of 2 Gaussians, got 4"),
    (lambda: project(SCENE, CAMERA, num_sigmas=np.array([1.0, 0])), r"must be positive and finite, got 0\.0"),
    *each(lambda v: project(SCENE, CAMERA, low_pass=v), NEGATIVE, "low_pass must be >= 0 and finite"),
    (lambda: project(SCENE, CAMERA, num_threads=-3), "num_threads must be in 1 to 1024, got -3; omit it"),
    (lambda: project(SCENE, CAMERA, order="size"), "project: order must be one of depth, soft, got 'size'"),
    (lambda: render(ODD, CAMERA, THREE), "project: brushes must be rows of the brush set, which has 3"),
    (lambda: Lamp(azimuth=np.nan), "Lamp: azimuth must be finite, got nan"),
    *each(lambda v: Lamp(elevation=v), (0.0, 1.6), "Lamp: elevation must be above 0 to pi / 2, got"),
    (lambda: Lamp(strength=1.1), "Lamp: strength must be in 0 to 1, got 1.1"),
    (lambda: Lamp(gloss=-0.1), "Lamp: gloss must be in 0 to 1, got -0.1"),
    (lambda: Lamp(exponent=0), "Lamp: exponent must be in 1 to 1000, got 0"),
    (lambda: light(FRAME.rgb, np.zeros((4, 6))), r"light: height must have shape \[H=4, W=5\], got \[4, 6\]"),
    (lambda: light(FRAME.rgb, FRAME.alpha, blur=11), "light: blur must be in 0 to 10 pixels, got 11"),
    (lambda: light(FRAME.rgb, FRAME.alpha, out=FRAME.alpha), "light: out must be a contiguous array of the"),
    (lambda: Lamp().at_relief(1.5), "Lamp: relief must be in 0 to 1, got 1.5"),
    (lambda: press(FRAME, np.zeros((5, 4)), 0.4), r"press: grain must have shape \[H=4, W=5\], got \[5, 4\]"),
    *each(lambda v: press(FRAME, FRAME.alpha, v), NOT_A_SHARE, "dry must be in 0 to 1"),
    *each(lambda v: thin_to_border(BOXES, CAMERA, width=v), NOT_POSITIVE, "width must be positive and"),
    *each(lambda v: thin_to_border(BOXES, CAMERA, seed=v), (-1, 2**32), "seed must be in 0 to"),
    (lambda: flat(np.zeros((7, 5, 3)), height=5, width=7), r"shape \[3\] or \[5, 7, 3\], got \[7, 5, 3\]"),
]
TYPES = [
    (lambda: draw(DEEP, underpaint=True), "rasterize: underpaint must be None or Underpaint, got bool"),
    (lambda: draw(in_front_of=1.0), "in_front_of must be None or DepthTest, got float"),
    (held_to([[1.0]], [1.0]), "limit must be a NumPy array"),
    (lambda: project({}, CAMERA), "project: gaussians must be Gaussians, got dict"),
    (lambda: project(SCENE, (1, 2)), "project: camera must be a Camera, got tuple"),
    (lambda: project(SCENE, CAMERA, num_threads=2.0), "num_threads must be an integer, got float; omit it"),
    (lambda: project(SCENE, CAMERA, relief=0.5), "relief must be a bool or a Relief, got float"),
    (lambda: render(SCENE, CAMERA, None), "texture must be a StrokeTexture, .* a picture as an array, got N"),
    (lambda: Lamp(exponent=2.5), "Lamp: exponent must be an int, got float"),
    (lambda: light(FRAME.rgb, np.zeros((4, 5), np.float32)), "height must be float64 like rgb, got float32"),
    (lambda: light(np.zeros((4, 5, 3), np.uint8), FRAME.alpha), "light: rgb must be float32 or float64, got"),
    (lambda: press(FRAME, 0.5, 0.4), "grain must be a NumPy array"),
]


@for_each("call, sentence, error", [(*v, ValueError) for v in VALUES] + [(*t, TypeError) for t in TYPES])
def test_values_out_of_range_and_arguments_of_another_type_are_refused_by_name(call, sentence, error):
    with pytest.raises(error, match=sentence):
        call()


@for_each("bad", BAD_NUMBERS)
@for_each("name", ["centers", "half_extents", "angles", "depths", "colors", "opacities"])
@for_each("dtype", [np.float32, np.float64])
def test_poisoned_boxes_are_refused_by_column_and_row(name, bad, dtype):
    boxes = random_boxes(9, 20, 20, dtype=dtype)
    column = getattr(boxes, name).copy()
    column[6:8] = bad
    with pytest.raises(ValueError, match=f"Boxes: {name} must be finite, got 2 other rows, first at 6"):
        replace(boxes, **{name: column})


@for_each("bad", BAD_NUMBERS)
@for_each("name", ["means", "quats", "scales", "opacities", "sh"])
def test_poisoned_gaussians_are_refused_by_column_and_row(name, bad):
    column = getattr(SCENE, name).copy()
    column.reshape(2, -1)[1, -1] = bad
    with pytest.raises(ValueError, match=f"Gaussians: {name} must be finite, got 1 other rows, first at 1"):
        replace(SCENE, **{name: column})


def test_arguments_are_not_written_to():
    painting = painting_of("mip soft=0.5 raised layered three", 50, 20, 20)
    boxes = painting.boxes
    before = {name: getattr(boxes, name).copy() for name in Boxes.__dataclass_fields__}
    painting.frame()
    rasterize(replace(boxes, brushes=None), TEXTURE, height=20, width=20)
    rasterize(replace(boxes, brushes=None), bristles(), height=20, width=20)
    for name, column in before.items():
        np.testing.assert_array_equal(getattr(boxes, name), column)


def test_the_longest_picture_that_is_allowed_can_be_painted():
    boxes = boxes_of([[32766.5, 0.5], [3, 0.5]], 2)
    for width, height in ((32767, 1), (1, 32767)):
        flipped = boxes if height == 1 else replace(boxes, centers=boxes.centers[:, ::-1])
        frame = rasterize(flipped, TEXTURE, height=height, width=width)
        assert np.flatnonzero(frame.alpha.ravel()).tolist() == [1, 2, 3, 4, 32765, 32766]


def test_render_takes_the_extent_of_the_stroke():
    """The plain Gaussian is cut at 3 standard deviations, a stroke where it paints enough."""
    full = StrokeTexture.from_coverage(np.full((8, 8), 255, np.uint8))
    for texture, sigmas in ((StrokeTexture.open("gaussian"), 3.0), (full, 1.2 * np.sqrt(np.pi / 2))):
        frame = render(SCENE, CAMERA, texture)
        np.testing.assert_array_equal(frame.rgb, render(SCENE, CAMERA, texture, num_sigmas=sigmas).rgb)
        assert np.abs(frame.rgb - render(SCENE, CAMERA, texture, num_sigmas=5 - sigmas).rgb).max() > 0.01


def test_the_thresholds_are_those_that_scenes_are_trained_with():
    assert (constants.MAX_ALPHA, constants.MIN_ALPHA) == (0.99, 1 / 255)
    assert 0.9999e-4 < constants.MIN_TRANSMITTANCE < 1e-4
    assert StrokeTexture.open("gaussian").num_sigmas == constants.GAUSSIAN_SIGMAS


def test_a_stroke_is_taken_by_its_name(tmp_path):
    path = tmp_path / "mine.png"
    path.write_bytes((strokes_folder() / "flat.png").read_bytes())
    for draws in (
        lambda stroke: render(SCENE, CAMERA, stroke),
        lambda stroke: next(render_sequence(SCENE, [CAMERA], stroke)),
        lambda stroke: rasterize(BOXES, stroke, height=9, width=8),
    ):
        by_texture = draws(StrokeTexture.open("flat"))
        assert by_texture.alpha.any()
        for named in ("flat", "Flat", path, str(path)):
            np.testing.assert_array_equal(draws(named).rgb, by_texture.rgb)
