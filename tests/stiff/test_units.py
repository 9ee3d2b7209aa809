"""A scene in another unit is the same painting: bit for bit for powers of two, else up to rounding."""

from functools import cache

import numpy as np
import pytest

import brushgs as bg
from brushgs import cli
from brushgs.cameras.around import near_views, ring_views, subject_ahead
from brushgs.first_view import find_first_view
from brushgs.formats.pictures.images import read_image
from tests.doctor.scenes import scaled
from tests.kit.for_each import for_each
from tests.scenes import still_life_of

SIZE = {"width": 96, "height": 64}


def table(boxes):
    """All of some boxes that has no unit."""
    return np.column_stack([boxes.centers, boxes.half_extents, boxes.angles, boxes.opacities, boxes.ids])


@cache
def painted(exponent):
    """What a scene in so many powers of two becomes on its way, as tables without a unit."""
    unit = 2.0**exponent
    scene = bg.clean(scaled(still_life_of(2000), unit))
    view = find_first_view(scene)
    camera = bg.frame_scene(scene, **SIZE)
    around = [*near_views(camera, subject_ahead(camera, view), view.up), *ring_views(view, **SIZE)]
    views = bg.plain_views(scene, around)
    kept = bg.prune(scene, 0.7)
    strokes = bg.orient(bg.solidify(bg.cluster(kept, 150, views=views)), kept, "form")
    path = bg.orbit(scene, 4, **SIZE)
    return {
        "first view": np.concatenate([view.points.ravel() / unit, view.up, [view.azimuth, view.elevation]]),
        "camera": np.column_stack([camera.viewmat[:3, :3], camera.viewmat[:3, 3] / unit]),
        "near": np.array([camera.near / unit]),
        "plain": table(bg.project(scene, camera)),
        "alone": table(bg.project(bg.cluster(kept, 150), camera)),
        "seen": table(bg.project(strokes, camera)),
        "track": np.concatenate([table(boxes) for boxes in bg.track(strokes, path)]),
    }


@for_each("exponent", [-60, 47])
def test_boxes_of_a_scene_times_a_power_of_two_are_the_same_bit_for_bit(exponent):
    for name, expected in painted(0).items():
        np.testing.assert_array_equal(painted(exponent)[name], expected, err_msg=name)


@pytest.fixture(scope="module")
def show(tmp_path_factory):
    """Unit of the still life in a file -> exit code and picture."""
    folder = tmp_path_factory.mktemp("units")

    @cache
    def shown(unit):
        path = folder / f"{unit:g}.ply"
        bg.save(scaled(still_life_of(2000), unit), path)
        picture = path.with_suffix(".png")
        how = "--stroke gaussian --look plain --size 96x64 --quiet"
        code = cli.main(["render", str(path), *how.split(), "-o", str(picture)])
        assert picture.exists() == (code == 0)
        return code, None if code else read_image(picture)

    return shown


@for_each("unit", [1e-18, 1e-6, 1e12])
def test_a_picture_of_a_file_in_any_unit_is_the_same(unit, show):
    """Files hold logarithms of scales, rounded to float32."""
    away = np.abs(show(unit)[1] - show(1.0)[1])
    assert away.max() <= 1.01 / 255
    assert (away > 0).mean() < 0.01


@for_each("unit", [1e-30, 1e30])
def test_a_unit_that_float32_has_no_room_for_is_refused_in_a_sentence(unit, show, capsys):
    assert show(unit)[0] == 2
    error = capsys.readouterr().err
    assert f"{unit:g}.ply" in error
    assert "can be painted; scale it before it is exported" in error
