"""What surrounds land seen from the air in the manner of paintings: where maps lie and how marks run."""

import numpy as np
import pytest

from brushgs.cameras.framing import frame_scene, plain_first_view
from brushgs.passes.add.around_land import around_land
from brushgs.rendering.plain import plain_views
from tests.kit.for_each import for_each
from tests.passes.add.test_stage import SIZE, crate
from tests.passes.add.test_stage_map import manner, turned_by


def around(degrees, one, azimuth=0.0):
    land, view = crate(), plain_first_view(crate())
    camera = frame_scene(view, **SIZE, elevation=np.radians(degrees), azimuth=np.radians(azimuth))
    return camera, around_land(one, land, view, [camera])


@for_each("degrees", [45, 60, 90])
@for_each("azimuth", [0, 130])
def test_the_map_fills_the_first_picture_upright(degrees, azimuth):
    camera, strokes = around(degrees, manner(), azimuth)  # blue for 0.6 of its height
    frame = plain_views(strokes, [camera]).frames[0]
    assert frame.alpha.min() > 0.6
    picture = frame.rgb / frame.alpha[..., None]
    blue = picture[..., 2] > picture[..., 0]
    assert blue[: SIZE["height"] // 3].mean() > 0.95
    assert blue[-SIZE["height"] // 4 :].mean() < 0.1


@for_each("turn", [0, 30, 90, 150])
@for_each("degrees", [45, 60, 90])
def test_marks_run_in_the_first_picture_as_in_the_painting(turn, degrees):
    camera, strokes = around(degrees, manner(angle=np.radians(turn)))
    _, y, z = (strokes.means @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]).T
    middle = np.abs(y / z) < 0.4 * SIZE["height"] / 2 / camera.K[1, 1]  # none is mirrored
    away, agreement = turned_by(strokes.take(middle), camera, turn)
    assert away < 6
    assert agreement > 0.85  # to the sides of the picture they turn


def test_marks_have_the_size_of_the_painting_in_the_picture_and_are_not_too_many():
    camera, strokes = around(45, manner(size=0.05))
    z = (strokes.means @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3])[:, 2]
    seen = np.median(3 * strokes.scales[:, 0] / z) * camera.K[0, 0]  # 3 standard deviations show
    assert seen == pytest.approx(2 * 0.05 * min(SIZE.values()), rel=0.25)  # the aspect is 4
    _, fine = around(45, manner(size=0.001))
    assert 8_000 < len(fine) < 40_000


def test_without_a_share_of_maps_it_is_a_toned_ground():
    _, strokes = around(45, manner(0.0, marks=0.0))
    colors = strokes.sh[:, 0]
    np.testing.assert_allclose(colors, np.broadcast_to(colors[0], colors.shape), atol=1e-6)
