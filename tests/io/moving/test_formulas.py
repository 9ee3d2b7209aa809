"""Each closed form against float64 arithmetic of the tests; what rests; rows that cannot be drawn."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs import SceneError, SceneWarning
from brushgs.formats.moving import open_moving
from brushgs.values.moving import MovingScene
from tests.io.moving import clips
from tests.io.ply_maker import write_scene

Columns = clips.Columns
TIMES = (0.0, 0.03, 0.31, 0.5, 0.77, 1.0)


def _spacetime(path: Path, columns: Columns) -> Path:
    return write_scene(path / "clip.ply", columns)


def _freetime(path: Path, columns: Columns) -> Path:
    return clips.write_freetime(path / "clip.ftgs.ply", columns)


def _splatv(path: Path, columns: Columns) -> Path:
    file = path / "clip.splatv"
    file.write_bytes(clips.encode_splatv(columns))
    return file


Write = Callable[[Path, Columns], Path]
At = Callable[[Columns, float], clips.Moment]
FORMS: dict[str, tuple[Write, Columns, At]] = {
    "spacetime": (_spacetime, clips.spacetime_columns(500), clips.spacetime_at),
    "splatv": (_splatv, clips.spacetime_columns(500, 1), clips.splatv_at),
    "freetime": (_freetime, clips.freetime_columns(500), clips.freetime_at),
    "freetime, degree 2": (_freetime, clips.freetime_columns(300, 2), clips.freetime_at),
}


def opened(path: Path) -> MovingScene:
    scene = open_moving(path)
    assert scene is not None
    return scene


def assert_equal(gaussians: bg.Gaussians, expected: clips.Moment) -> None:
    for name, values in expected.items():
        # Below the normal numbers of float32, which end at 1e-38, digits are lost.
        np.testing.assert_allclose(getattr(gaussians, name), values, rtol=1e-6, atol=1e-37, err_msg=name)


@pytest.mark.parametrize("name", FORMS)
def test_moments_equal_float64_arithmetic_to_one_in_a_million(name, tmp_path):
    write, columns, at = FORMS[name]
    scene = opened(write(tmp_path, columns))
    assert scene.has_rows
    for time in TIMES:
        expected = at(columns, time)
        gaussians = scene.at(time * scene.duration)
        assert gaussians.means.dtype == np.float32
        # Sums that nearly cancel keep the digits of float64, but rounding of the colours is that of float32.
        colors = expected.pop("sh")
        assert_equal(gaussians, expected)
        np.testing.assert_allclose(gaussians.sh, colors, rtol=1e-6, atol=5e-7)


@pytest.mark.parametrize("name", FORMS)
def test_times_outside_the_clip_are_its_ends(name, tmp_path):
    write, columns, _ = FORMS[name]
    scene = opened(write(tmp_path, columns))
    for outside, end in ((-1, 0), (scene.duration + 1, scene.duration)):
        assert np.array_equal(scene.at(outside).means, scene.at(end).means)


def test_comments_of_freetimegs_are_heeded(tmp_path):
    columns = clips.freetime_columns(200)
    still = opened(clips.write_freetime(tmp_path / "a.ply", columns, ["comment use_velocity 0"]))
    expected = np.stack([columns[axis] for axis in "xyz"], 1)
    for time in (0, 0.4, 1):
        assert np.array_equal(still.at(time * still.duration).means, expected)
    long = opened(clips.write_freetime(tmp_path / "a.ply", columns, ["comment min_duration 0.5"]))
    at = clips.freetime_at(columns, 0.2, shortest=0.5)
    np.testing.assert_allclose(long.at(0.2 * long.duration).opacities, at["opacities"], rtol=1e-6)


FAULTY_COMMENTS = {
    "time_units seconds": r"time_units seconds.*normalized.*; export",
    "min_duration -1": "min_duration -1.*0 or more; export",
    "min_duration nan": "min_duration nan.*0 or more; export",
    "n_frames many": "n_frames many.*0 or more; export",
    "n_frames 2.5": "n_frames must be a whole number",
    "n_frames 1e30": "n_frames must be a whole number",
}


@pytest.mark.parametrize("comment", FAULTY_COMMENTS)
def test_comments_that_make_no_sense_are_refused(comment, tmp_path):
    path = clips.write_freetime(tmp_path / "a.ply", clips.freetime_columns(9), [f"comment {comment}"])
    with pytest.raises(SceneError, match=FAULTY_COMMENTS[comment]):
        open_moving(path)


def rest(columns: Columns, rows: slice) -> None:
    """Take the motion of some rows, in place."""
    for name, values in columns.items():
        if name.startswith(("motion_", "omega_", "velocity_")):
            values[rows] = 0
        elif name in ("trbf_scale", "log_duration"):
            values[rows] = 20


@pytest.mark.parametrize("name", FORMS)
def test_rows_that_rest_are_known_and_stay(name, tmp_path):
    write, columns, _ = FORMS[name]
    columns = {key: values.copy() for key, values in columns.items()}
    rest(columns, slice(0, 100))
    scene = opened(write(tmp_path, columns))
    assert scene.resting is not None
    assert np.array_equal(np.flatnonzero(scene.resting), np.arange(100))
    first, later = scene.at(0), scene.at(0.7 * scene.duration)
    assert np.array_equal(first.means[:100], later.means[:100])
    assert np.array_equal(first.quats[:100], later.quats[:100])
    np.testing.assert_allclose(first.opacities[:100], later.opacities[:100], atol=1e-3)


def test_a_row_that_does_not_move_but_fades_does_not_rest(tmp_path):
    columns = clips.spacetime_columns(40)
    rest(columns, slice(0, 40))
    columns["opacity"][:] = 2
    columns["trbf_scale"][:10] = 0
    columns["trbf_center"][10:20], columns["trbf_scale"][10:20] = 5, 0  # long before and after the clip
    scene = opened(_spacetime(tmp_path, columns))
    assert scene.resting is not None
    assert np.array_equal(np.flatnonzero(~scene.resting), np.arange(10))
    assert scene.at(scene.duration).opacities[10:20].max() < 1e-6


FAULTS: dict[str, tuple[str, list[tuple[str, float]]]] = {
    "spacetime": (
        "trbf_scale",
        [("motion_4", np.nan), ("omega_1", np.inf), ("trbf_center", -np.inf), ("x", np.nan)],
    ),
    "splatv": ("trbf_scale", [("motion_4", np.nan), ("omega_1", np.inf), ("trbf_center", -np.inf)]),
    "freetime": ("log_duration", [("velocity_0", np.inf), ("time", np.nan), ("f_dc_1", np.nan)]),
}


@pytest.mark.parametrize("name", FAULTS)
def test_rows_that_cannot_be_drawn_are_dropped_and_counted(name, tmp_path):
    write, columns, at = FORMS[name]
    columns = {key: values.copy() for key, values in columns.items()}
    width, faults = FAULTS[name]
    dropped = []
    for row, (column, value) in enumerate([(width, np.nan), *faults], 3):
        columns[column][row] = value
        dropped.append(row)
    for index in range(4):
        columns[f"rot_{index}"][50] = 0
    with pytest.warns(SceneWarning, match=f"{len(dropped) + 1} of 500 rows.*row 3, {width} = nan.*row 50"):
        scene = opened(write(tmp_path, columns))
    assert scene.notes is not None
    assert scene.notes.rows_dropped == len(dropped) + 1
    keep = np.setdiff1d(np.arange(500), [*dropped, 50])
    kept = {key: values[keep] for key, values in columns.items()}
    expected = at(kept, 0.6)
    del expected["sh"]
    assert_equal(scene.at(0.6 * scene.duration), expected)
    assert scene.resting is not None
    assert len(scene.resting) == len(keep)


def test_a_file_without_a_row_that_can_be_drawn_is_refused(tmp_path):
    for write, columns, _ in FORMS.values():
        columns = {key: values.copy() for key, values in columns.items()}
        columns["x"][:] = np.nan
        with pytest.raises(SceneError, match=r"no row of [35]00 can be used.*; export"):
            open_moving(write(tmp_path, columns))


@pytest.mark.parametrize("name", ["omega_2", "motion_8"])
def test_a_column_that_is_missing_is_named(name, tmp_path):
    columns = clips.spacetime_columns(9)
    del columns[name]
    with pytest.raises(SceneError, match=f"no property '{name}' among .* SpaceTimeGaussian PLY has; export"):
        open_moving(_spacetime(tmp_path, columns))


def test_a_ply_file_that_is_cut_off_is_refused(tmp_path):
    for write, columns, _ in (FORMS["spacetime"], FORMS["freetime"]):
        path = write(tmp_path, columns)
        path.write_bytes(path.read_bytes()[:-100])
        with pytest.raises(SceneError, match="is cut off: of 500 rows"):
            open_moving(path)
