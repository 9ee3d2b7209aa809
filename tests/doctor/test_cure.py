"""A cured scene equals the sound one, and the doctor finds no fault in it."""

import numpy as np
import pytest

import brushgs as bg
from brushgs.doctor import cure, examine_file, run_doctor
from brushgs.values.sh import C0
from tests.doctor import plant
from tests.doctor.scenes import ball, fruit

# Through exp and log in float32 once more: the largest differences measured are 4.0e-6 (log-scales of -9
# have steps of 1e-6), 1.1e-6 and 5.0e-7 of the value.
ROUNDED = {"scales": 5e-6, "opacities": 2e-6}


def cured(planted, tmp_path):
    """Through files, as a user has it."""
    run_doctor(plant.write(planted, tmp_path / "planted.ply"), tmp_path / "cured.ply")
    left = {f.name: f.severity for f in bg.examine(tmp_path / "cured.ply")}
    assert "fault" not in left.values()
    return bg.load(tmp_path / "cured.ply")


def assert_same(found, expected, **tolerances):
    """Equal bit for bit, but for columns that are rounded, or have an absolute tolerance."""
    for name in ("means", "quats", "scales", "opacities", "sh"):
        bounds = {"rtol": ROUNDED.get(name, 0.0), "atol": tolerances.get(name, 0.0)}
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), err_msg=name, **bounds)


@pytest.fixture(params=[fruit, ball], ids=["fruit", "ball"])
def scene(request, tmp_path):
    """As it comes back from a file."""
    bg.save(request.param(), tmp_path / "scene.ply")
    return bg.load(tmp_path / "scene.ply")


def test_what_was_planted_is_taken_out_again(scene, tmp_path):
    columns, path = plant.columns_of(scene, tmp_path), tmp_path / "planted.ply"
    for way in (plant.nothing, plant.linear_scales, plant.linear_opacities, plant.byte_opacities, plant.xyzw):
        atol = {"opacities": 0.51 / 255 if way is plant.byte_opacities else 0.0}
        assert_same(cured(way(columns), tmp_path), scene, **atol)
        assert_same(bg.load(path, examine_file(path).encoding), scene, **atol)
    assert_same(cured(plant.unnormalised(columns), tmp_path), scene, quats=3e-7)


def test_rows_at_fault_are_dropped_and_the_others_kept(tmp_path):
    columns = plant.columns_of(ball(), tmp_path)
    scene = bg.load(tmp_path / "sound.ply")
    for name in ("non-finite-rows", "zero-quaternions", "duplicate-rows", "far-outliers", "screen-fillers"):
        planted = plant.SOME[name](columns, 0.01)
        assert_same(cured(planted, tmp_path), scene.take(np.flatnonzero(~planted.rows)))


def test_colors_come_back_as_far_as_the_file_held_them(tmp_path):
    """RGB of 0 to 1 is cut there, and bytes are rounded: that is lost for good."""
    columns = plant.columns_of(ball(), tmp_path)
    scene = bg.load(tmp_path / "sound.ply")
    expected = np.clip(0.5 + C0 * scene.sh[:, 0], 0, 1)
    for way, step in ((plant.linear_colors, 0.0), (plant.byte_colors, 0.5 / 255)):
        found, path = cured(way(columns), tmp_path), tmp_path / "planted.ply"
        for one in (found, bg.load(path, examine_file(path).encoding)):
            np.testing.assert_allclose(0.5 + C0 * one.sh[:, 0], expected, rtol=0, atol=step + 1e-6)
            np.testing.assert_array_equal(one.sh[:, 1:], scene.sh[:, 1:])


def test_empty_bands_are_stripped_and_no_picture_changes_by_half_a_step(tmp_path):
    columns = plant.columns_of(ball(), tmp_path)
    camera = bg.Camera.look_at((0, -1, -4), (0, 0, 0), width=64, height=48)
    for way, largest in ((plant.zero_bands, 0.0), (plant.faint_bands, 0.5 / 255)):
        found = cured(way(columns), tmp_path)
        assert found.sh_degree == 0
        np.testing.assert_array_equal(found.sh[:, 0], bg.load(tmp_path / "sound.ply").sh[:, 0])
        note = {f.name: f for f in bg.examine(tmp_path / "planted.ply")}["empty-sh-bands"]
        assert note.facts["largest"] <= largest
        scenes = bg.load(tmp_path / "planted.ply"), found
        before, after = (bg.render(one, camera, "gaussian").rgb for one in scenes)
        assert before.max() > 0.5
        assert np.abs(before - after).max() < 0.5 / 255


def test_curing_twice_is_curing_once(tmp_path):
    planted = plant.floaters(plant.outliers(plant.columns_of(fruit(), tmp_path)).columns)
    once = cured(planted, tmp_path)
    assert {f.name for f in bg.examine(tmp_path / "cured.ply") if f.severity != "note"} == set()
    run_doctor(tmp_path / "cured.ply", tmp_path / "again.ply")
    assert_same(bg.load(tmp_path / "again.ply"), once)


def test_a_scene_of_nothing_but_outliers_is_not_emptied(tmp_path):
    for count in (1, 2, 5):
        scene = ball().take(slice(count))
        apart = bg.Gaussians(1e6 * scene.means, scene.quats, scene.scales, scene.opacities, scene.sh)
        bg.save(apart, tmp_path / "a.ply")
        assert len(cure(examine_file(tmp_path / "a.ply"))) >= 1
