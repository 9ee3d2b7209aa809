"""What `rasterize` and `render` refuse, in which words; poisoned columns; constants shared with the core."""

import re
from dataclasses import replace

import numpy as np
import pytest

from brushgs.brushes.texture import StrokeTexture, strokes_folder
from brushgs.rendering import constants
from brushgs.rendering.rasterize import rasterize
from brushgs.rendering.render import render, render_sequence
from brushgs.rendering.underpaint import Underpaint
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from tests.kit.for_each import for_each
from tests.rendering.strokes import boxes_of, bristles, random_boxes, relieved, set_back, softened

TEXTURE = StrokeTexture.open("ellipse")
BOXES = boxes_of([[5, 5], [9, 9]], 3)
CAMERA = Camera.look_at((0, 0, -3), (0, 0, 0), width=20, height=10)
SCENE = Gaussians(np.zeros((2, 3)), np.ones((2, 4)), np.ones((2, 3)), np.ones(2), np.zeros((2, 1, 3)))
BAD_NUMBERS = [np.nan, np.inf, -np.inf]


@for_each(
    ("option", "message"),
    [
        (
            {"filter": "trilinear"},
            r"rasterize: filter must be one of mip, bilinear, nearest, got 'trilinear'",
        ),
        ({"filter": None}, r"rasterize: filter must be one of .*, got None"),
        ({"height": 0}, r"rasterize: height must be in 1 to 32767 pixels, got 0"),
        ({"width": -4}, r"rasterize: width must be in 1 to 32767 pixels, got -4"),
        ({"width": 32768}, r"rasterize: width must be in 1 to 32767 pixels, got 32768"),
        (
            {"width": 30000, "height": 30000},
            r"rasterize: width x height must be at most 268435456 pixels, got 30000",
        ),
        ({"num_threads": 0}, r"num_threads must be in 1 to 1024, got 0"),
        ({"min_transmittance": -1e-9}, r"rasterize: min_transmittance must be in \[0, 1\), got -1e-09"),
        ({"min_transmittance": 1.0}, r"rasterize: min_transmittance must be in \[0, 1\), got 1.0"),
        ({"min_transmittance": np.nan}, r"rasterize: min_transmittance must be in \[0, 1\), got nan"),
    ],
)
def test_options_out_of_range_are_refused_by_name(option, message):
    with pytest.raises(ValueError, match=message):
        rasterize(BOXES, TEXTURE, **{"height": 10, "width": 10} | option)


@for_each(
    ("option", "error", "message"),
    [
        ({"filter": "cubic"}, ValueError, "filter must be one of mip, bilinear, nearest, got 'cubic'"),
        ({"num_sigmas": 0.0}, ValueError, "num_sigmas must be positive and finite, got 0.0"),
        ({"num_sigmas": np.nan}, ValueError, "num_sigmas must be positive and finite, got nan"),
        ({"low_pass": -0.1}, ValueError, "low_pass must be >= 0 and finite, got -0.1"),
        ({"num_threads": -1}, ValueError, "num_threads must be in 1 to 1024, got -1"),
        ({"num_threads": 1.5}, TypeError, "num_threads must be an integer, got float"),
    ],
)
def test_render_refuses_what_its_steps_refuse(option, error, message):
    with pytest.raises(error, match=re.escape(message)):
        render(SCENE, CAMERA, TEXTURE, **option)


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
    boxes = random_boxes(50, 20, 20)
    boxes = set_back(softened(boxes, 0.5), 1.0)
    boxes = replace(relieved(boxes), brushes=np.zeros(len(boxes), np.uint8))
    before = {name: getattr(boxes, name).copy() for name in Boxes.__dataclass_fields__}
    rasterize(boxes, TEXTURE, height=20, width=20)
    rasterize(boxes, bristles(), height=20, width=20)
    rasterize(boxes, bristles(), height=20, width=20, underpaint=Underpaint(1.8), streaks=0.5)
    rasterize(boxes, bristles(), height=20, width=20, relief=True)
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
    gaussian, full = (
        StrokeTexture.open("gaussian"),
        StrokeTexture.from_coverage(np.full((8, 8), 255, np.uint8)),
    )
    for texture, sigmas in ((gaussian, 3.0), (full, 1.2 * np.sqrt(np.pi / 2))):
        frame = render(SCENE, CAMERA, texture)
        np.testing.assert_array_equal(frame.rgb, render(SCENE, CAMERA, texture, num_sigmas=sigmas).rgb)
        other = render(SCENE, CAMERA, texture, num_sigmas=5 - sigmas)
        assert np.abs(frame.rgb - other.rgb).max() > 0.01


def test_the_thresholds_are_those_that_scenes_are_trained_with():
    assert (constants.MAX_ALPHA, constants.MIN_ALPHA) == (0.99, 1 / 255)
    assert 0.9999e-4 < constants.MIN_TRANSMITTANCE < 1e-4
    assert StrokeTexture.open("gaussian").num_sigmas == constants.GAUSSIAN_SIGMAS


def test_a_stroke_is_taken_by_its_name(tmp_path):
    opened = StrokeTexture.open("flat")
    path = tmp_path / "mine.png"
    path.write_bytes((strokes_folder() / "flat.png").read_bytes())
    for named in ("flat", "Flat", path, str(path)):
        pictures = [
            (render(SCENE, CAMERA, named), render(SCENE, CAMERA, opened)),
            (next(render_sequence(SCENE, [CAMERA], named)), next(render_sequence(SCENE, [CAMERA], opened))),
            (rasterize(BOXES, named, height=9, width=8), rasterize(BOXES, opened, height=9, width=8)),
        ]
        for by_name, by_texture in pictures:
            assert by_texture.alpha.any()
            np.testing.assert_array_equal(by_name.rgb, by_texture.rgb)
    with pytest.raises(
        TypeError, match=r"texture must be a StrokeTexture, .*, a path or a picture as an array, got N"
    ):
        render(SCENE, CAMERA, None)
