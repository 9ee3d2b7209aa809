"""Strokes run as the marks of a painting that lies over the first picture."""

import numpy as np
import pytest

import brushgs as bg
from brushgs import SceneError
from brushgs.options.direction import Direction
from brushgs.passes.form.mark_directions import Marks
from tests.kit.for_each import for_each
from tests.passes.form.planks import long_axes, planks
from tests.passes.scenes import assert_same


def stripes(angle, height=120, width=160):
    """A picture of stripes that run at an angle from +x towards +y."""
    y, x = np.mgrid[:height, :width]
    wave = 0.5 + 0.4 * np.sin((x * np.sin(angle) - y * np.cos(angle)) * np.pi / 3)
    return np.repeat(wave[..., None], 3, axis=2).astype(np.float32)


def camera_above(eye=(0, 0, -3), target=(0, 0, 0), width=160, height=120):
    """Looks down on the planks: +x is right, +y is down in the picture."""
    return bg.Camera.look_at(eye, target, (0, -1, 0), width=width, height=height)


def grey(uv):
    return np.full((len(uv), 3), 0.5)


@for_each("degrees", [0, 30, 75, 90, 135, 170])
def test_strokes_run_as_the_stripes_do_in_the_picture(degrees):
    strokes, gaussians = planks()  # whose boards say otherwise
    angle = np.radians(degrees)
    after = bg.orient(strokes, gaussians, Marks.of_image(stripes(angle), camera_above()))
    axes = long_axes(after)
    assert np.quantile(np.abs(axes @ [np.cos(angle), np.sin(angle), 0]), 0.05) > np.cos(np.radians(10))


def test_a_slanted_surface_is_painted_as_it_appears():
    """The direction is right in the picture, not in the plane: by projecting a step along the stroke."""
    turn = np.radians(50)
    frame = np.array([[np.cos(turn), 0, -np.sin(turn)], [0, 1, 0], [np.sin(turn), 0, np.cos(turn)]])
    strokes, gaussians = planks(frame=frame, color=grey)
    camera = camera_above()
    after = bg.orient(strokes, gaussians, Marks.of_image(stripes(np.radians(40)), camera))

    def pixels(points):
        seen = points @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
        return (seen @ camera.K.T)[:, :2] / seen[:, 2:]

    steps = pixels(after.means + 1e-5 * long_axes(after)) - pixels(after.means)
    angles = np.degrees(np.arctan2(steps[:, 1], steps[:, 0])) % 180
    assert np.abs(np.quantile(angles, [0.1, 0.9]) - 40).max() < 8


def test_the_painting_fills_the_picture_and_is_cropped_to_its_centre():
    """Wider than the picture: its left and right quarter are not seen."""
    wide = np.concatenate([stripes(0, 120, 80), stripes(np.pi / 2, 120, 160), stripes(0, 120, 80)], axis=1)
    strokes, gaussians = planks(color=grey)
    after = bg.orient(strokes, gaussians, Marks.of_image(wide, camera_above()))
    assert np.quantile(np.abs(long_axes(after)[:, 1]), 0.05) > np.cos(np.radians(15))


def test_strokes_outside_the_picture_or_behind_the_camera_keep_the_form():
    strokes, gaussians = planks()
    form = bg.orient(strokes, gaussians)
    beside, away, edge_on = ((9, 0, -3), (9, 0, 0)), ((0, 0, -3), (0, 0, -6)), ((-3, 0, 0), (0, 0, 0))
    for view in (beside, away, edge_on):
        marks = Marks.of_image(stripes(1.0), camera_above(*view))
        assert_same(bg.orient(strokes, gaussians, marks), form)


@for_each(
    ("image", "message"),
    [
        (np.full((50, 50, 3), 0.3, np.float32), "must show marks, got one even color"),
        (stripes(0, 4, 90), "must have 1 to 4 channels and 8x8 pixels or more, got 3 in 90x4"),
        (np.zeros((50, 50, 5), np.float32), "got 5 in 50x50"),
    ],
)
def test_pictures_without_marks_are_refused(image, message):
    with pytest.raises(ValueError, match=message):
        Marks.of_image(image, camera_above())


def test_a_direction_names_the_picture_and_needs_a_camera(tmp_path):
    strokes, gaussians = planks(500, 50)
    for name, picture in (("stripes.exr", stripes(0.7)), ("grey.png", 0 * stripes(0) + 0.5)):
        bg.save(bg.Frame(picture, np.ones((120, 160), np.float32), None), tmp_path / name)
    direction, camera = Direction.of(f"painting:{tmp_path / 'stripes.exr'}"), camera_above()
    axes = long_axes(bg.orient(strokes, gaussians, direction, camera=camera))
    assert np.quantile(np.abs(axes @ [np.cos(0.7), np.sin(0.7), 0]), 0.1) > 0.97
    with pytest.raises(ValueError, match="orient: camera must be given with a painting"):
        bg.orient(strokes, gaussians, direction)
    with pytest.raises(SceneError, match=r"grey\.png: has no marks to follow .*; choose another picture"):
        bg.orient(strokes, gaussians, Direction.of(f"painting:{tmp_path / 'grey.png'}"), camera=camera)
