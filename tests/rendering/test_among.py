"""Gaussians among strokes are shown as the plain picture shows them."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.brushes.soft import soft_brush
from brushgs.measure.likeness import psnr
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.rendering.options import RenderOptions, render_with
from brushgs.rendering.relief import Relief
from brushgs.still_life import still_life_camera
from tests.kit import for_each, still_life_of

CAMERA = still_life_camera(width=240, height=180)
KERNEL = bg.StrokeTexture.open("gaussian")
FLAT = bg.StrokeTexture.open("flat")
SCENE = still_life_of(6000)
PLAIN = render_with(SCENE, CAMERA, KERNEL, RenderOptions.of(KERNEL))


def coat(strokes, texture=FLAT, **options):
    made = RenderOptions.of(texture, **{"underpaint": True, "streaks": 0.3} | options)
    return Coat("strokes", strokes, texture, made)


@for_each(
    "options",
    [{}, {"order": "soft"}, {"relief": Relief()}, {"underpaint": False}],
    ids=["plain", "soft order", "relief", "no underpaint"],
)
@for_each("texture", [FLAT, bg.BrushSet.open("flat,dab")], ids=["one brush", "two"])
def test_a_coat_without_strokes_is_the_plain_picture(texture, options):
    nothing = SCENE.take(slice(0))
    frame = Painting((coat(nothing, texture, **options).showing(SCENE),)).frame(CAMERA)
    assert psnr(frame.rgb, PLAIN.rgb) > 48
    np.testing.assert_allclose(frame.alpha, PLAIN.alpha, atol=0.03)
    if "relief" in options:
        assert np.abs(frame.height).max() == 0


def test_strokes_and_gaussians_hide_each_other_by_depth():
    wall = bg.Gaussians([[0, 0, 2.0]], [[1, 0, 0, 0]], [[2, 2, 0.01]], [1.0], [[[-1.7, -1.7, 1.7]]])
    for depth, channel in ((1.0, 0), (3.0, 2)):
        stroke = replace(wall, means=[[0, 0, depth]], sh=np.array([[[1.7, -1.7, -1.7]]], np.float32))
        camera = bg.Camera.look_at((0, 0, -4), (0, 0, 0), width=32, height=32)
        for painted, plain in ((stroke, wall), (wall, stroke)):
            made = coat(painted, underpaint=False, streaks=0.0)
            frame = Painting((made.showing(plain),)).frame(camera)
            assert frame.rgb[16, 16].argmax() == channel


def test_boxes_of_strokes_are_as_without_gaussians_but_for_their_place():
    left = SCENE.means[:, 0] < 0
    strokes, plain = SCENE.take(left), SCENE.take(~left)
    alone = coat(strokes, relief=Relief())
    expected, culled = alone.boxes(CAMERA)
    found, both = alone.showing(plain).boxes(CAMERA)
    own = found.ids < len(strokes)
    for name in ("centers", "angles", "depths", "opacities", "ids", "setbacks", "reliefs"):
        np.testing.assert_array_equal(getattr(found, name)[own], getattr(expected, name))
    assert (found.brushes == ~own).all()
    assert (found.setbacks[~own] == 0).all()
    assert (found.reliefs[~own] == 0).all()
    assert (np.diff(found.depths) >= 0).all()
    assert len(found) + both.total == len(SCENE)
    assert both.total >= culled.total


def test_another_kernel_is_refused():
    ellipse = bg.StrokeTexture.open("ellipse")
    with pytest.raises(ValueError, match=r"--stroke ellipse cannot paint a part .*; name a brush"):
        Coat("strokes", SCENE, ellipse, RenderOptions.of(ellipse)).showing(SCENE)


def test_the_kernel_shows_gaussians_itself():
    left = SCENE.means[:, 0] < 0
    shown = coat(SCENE.take(left), KERNEL, underpaint=False, streaks=0.0).showing(SCENE.take(~left))
    assert shown.texture.names == ("gaussian",)
    np.testing.assert_allclose(Painting((shown,)).frame(CAMERA).rgb, PLAIN.rgb, atol=1e-5)


def test_the_soft_brush_is_fitted_as_the_kernel_is():
    assert soft_brush().fitted_sigmas == KERNEL.num_sigmas
