"""Paintings drop floaters, and with `strokes_for="view"` what no view sees."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats.scenes.write import write_scene
from brushgs.options.sequence import PathConfig
from brushgs.pipeline.prepare import PICTURE, prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.still import paint
from tests.doctor.scenes import ball
from tests.kit import changed, for_each, stages, without_look
from tests.passes.reduce.test_floaters import blobs, joined

DIRTY = joined(ball(), blobs([(0, 2.5, 0), (2.5, 0, 0)], 0.1))
OPAQUE = replace(ball(), scales=2 * ball().scales, opacities=np.full(len(ball()), 0.99, np.float32))
ASIDE = replace(OPAQUE, means=OPAQUE.means + np.float32([9, 0, 0]))
TWO = joined(OPAQUE, ASIDE)
CAMERA = bg.Camera.look_at((0, 0, -4), (0, 0, 0), width=96, height=72)  # sees one of the two
PAINT = without_look("flat", 200, (96, 72))
FOR_VIEW = changed(PAINT, cluster={"strokes_for": "view"})


def made(scene, config=PAINT, **options):
    report = Report()
    return prepare(scene, config, report, **options), stages(report)


@for_each(("floaters", "dropped"), [("off", 0), ("sure", 2)])
def test_floaters_are_dropped_before_the_view_is_framed(floaters, dropped):
    config = changed(PAINT, clean={"floaters": floaters})
    prepared, found = made(DIRTY, config, asks=(*PICTURE, "scene"))
    assert len(DIRTY) - len(prepared.whole_scene) == dropped
    assert found["clean"].counts["after"] == len(DIRTY) - dropped
    if dropped:
        clean, _ = made(ball(), config)
        np.testing.assert_array_equal(prepared.camera.viewmat, clean.camera.viewmat)


def test_strokes_are_not_searched_for_floaters(tmp_path):
    write_scene(DIRTY, tmp_path / "strokes.ply", is_strokes=True)
    prepared, found = made(tmp_path / "strokes.ply", changed(PAINT, cluster={"strokes": None}))
    assert len(prepared.strokes) == len(DIRTY)
    assert "they are strokes already" in found["clean"].skipped[0]


def test_the_report_says_where_strong_would_help():
    _, found = made(joined(ball(), blobs((0, 0, 1.1), 0.02)))
    assert "1 more may be floaters: --clean strong drops them too" in found["clean"].did


def test_all_strokes_are_spent_where_the_camera_looks():
    prepared, found = made(TWO, FOR_VIEW, views=CAMERA)
    assert (prepared.strokes.means[:, 0] < 4).all()
    assert (prepared.strokes.means[:, 2] < 0.3).all()  # the back of the ball is hidden
    assert found["seen"].counts["after"] < len(ball())
    assert found["prune"].skipped == ["pruning: what is not seen is dropped already"]
    both, found = made(TWO, views=CAMERA)
    assert "seen" not in found
    assert (both.strokes.means[:, 0] > 4).sum() > 50


def test_the_report_says_when_most_strokes_lie_outside():
    far = bg.Camera.look_at((9, 0, -1.5), (9, 0.5, 0), width=96, height=72)
    for config, says in ((PAINT, True), (FOR_VIEW, False)):
        report = Report()
        paint(TWO, config, camera=far, report=report)
        assert ("--strokes-for view" in stages(report)["project"].did) == says


def test_along_a_path_what_any_of_its_views_sees_is_kept():
    prepared, found = made(ball(), FOR_VIEW, views=PathConfig(orbit=48))
    assert found["seen"].counts["views"] == 24
    assert (prepared.strokes.means[:, 2] > 0.5).any()
    assert (prepared.strokes.means[:, 2] < -0.5).any()


def test_a_view_that_sees_nothing_keeps_everything():
    away = bg.Camera.look_at((0, 0, -4), (0, 0, -9), width=96, height=72)
    report = Report()
    with pytest.warns(bg.SceneWarning, match="no stroke is in the picture"):
        paint(ball(), FOR_VIEW, camera=away, report=report)
    assert stages(report)["seen"].counts["after"] == len(ball())
