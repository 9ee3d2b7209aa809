"""Each closed form against float64 arithmetic of the tests; what rests; rows that cannot be drawn."""

import numpy as np
import pytest

from brushgs import SceneWarning
from brushgs.formats.moving import open_moving
from tests.io.moving import clips
from tests.io.ply_maker import write_scene
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse

TIMES = (0.0, 0.03, 0.31, 0.5, 0.77, 1.0)


def spacetime(folder, columns):
    return write_scene(folder / "clip.ply", columns)


def freetime(folder, columns):
    return clips.write_freetime(folder / "clip.ftgs.ply", columns)


def splatv(folder, columns):
    (folder / "clip.splatv").write_bytes(clips.encode_splatv(columns))
    return folder / "clip.splatv"


# How a clip is written, its columns, its moments by definition, and what breaks rows.
FAULTS = [("motion_4", np.nan), ("omega_1", np.inf), ("trbf_center", -np.inf)]
FORMS = {
    "spacetime": (spacetime, clips.spacetime_columns(200), clips.spacetime_at, [*FAULTS, ("x", np.nan)]),
    "splatv": (splatv, clips.spacetime_columns(200, 1), clips.splatv_at, FAULTS),
    "freetime": (
        freetime,
        clips.freetime_columns(200, 2),
        clips.freetime_at,
        [("velocity_0", np.inf), ("time", np.nan), ("f_dc_1", np.nan)],
    ),
}


def assert_equal(gaussians, expected):
    for name, values in expected.items():
        # Below the normal numbers of float32, which end at 1e-38, digits are lost. Sums that nearly
        # cancel keep the digits of float64, but rounding of the colors is that of float32.
        atol = 5e-7 if name == "sh" else 1e-37
        np.testing.assert_allclose(getattr(gaussians, name), values, rtol=1e-6, atol=atol, err_msg=name)


@for_each("name", FORMS)
def test_moments_equal_float64_arithmetic_to_one_in_a_million(name, tmp_path):
    write, columns, at, _ = FORMS[name]
    scene = open_moving(write(tmp_path, columns))
    assert scene.has_rows
    for time in TIMES:
        gaussians = scene.at(time * scene.duration)
        assert gaussians.means.dtype == np.float32
        assert_equal(gaussians, at(columns, time))
    for outside, end in ((-1, 0), (scene.duration + 1, scene.duration)):
        assert np.array_equal(scene.at(outside).means, scene.at(end).means)


def test_comments_of_freetimegs_are_heeded(tmp_path):
    columns = clips.freetime_columns(200)
    still = open_moving(clips.write_freetime(tmp_path / "a.ply", columns, ["comment use_velocity 0"]))
    expected = np.stack([columns[axis] for axis in "xyz"], 1)
    for time in (0, 0.4, 1):
        assert np.array_equal(still.at(time * still.duration).means, expected)
    long = open_moving(clips.write_freetime(tmp_path / "a.ply", columns, ["comment min_duration 0.5"]))
    at = clips.freetime_at(columns, 0.2, shortest=0.5)
    np.testing.assert_allclose(long.at(0.2 * long.duration).opacities, at["opacities"], rtol=1e-6)


@for_each(
    "comment, sentence",
    [
        ("time_units seconds", r"time_units seconds.*normalized.*; export"),
        ("min_duration -1", "min_duration -1.*0 or more; export"),
        ("min_duration nan", "min_duration nan.*0 or more; export"),
        ("n_frames many", "n_frames many.*0 or more; export"),
        ("n_frames 2.5", "n_frames must be a whole number"),
        ("n_frames 1e30", "n_frames must be a whole number"),
    ],
)
def test_comments_that_make_no_sense_are_refused(comment, sentence, tmp_path):
    path = clips.write_freetime(tmp_path / "a.ply", clips.freetime_columns(9), [f"comment {comment}"])
    refuse(path, sentence, open_moving)


def copied(columns):
    return {key: values.copy() for key, values in columns.items()}


def rest(columns, rows):
    """Take the motion of some rows, in place."""
    for name, values in columns.items():
        if name.startswith(("motion_", "omega_", "velocity_")):
            values[rows] = 0
        elif name in ("trbf_scale", "log_duration"):
            values[rows] = 20


@for_each("name", FORMS)
def test_rows_that_rest_are_known_and_stay(name, tmp_path):
    write, columns = FORMS[name][0], copied(FORMS[name][1])
    rest(columns, slice(0, 100))
    scene = open_moving(write(tmp_path, columns))
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
    scene = open_moving(spacetime(tmp_path, columns))
    assert np.array_equal(np.flatnonzero(~scene.resting), np.arange(10))
    assert scene.at(scene.duration).opacities[10:20].max() < 1e-6


@for_each("name", FORMS)
def test_rows_that_cannot_be_drawn_are_dropped_and_counted(name, tmp_path):
    write, columns, at, faults = FORMS[name]
    columns, width = copied(columns), "log_duration" if name == "freetime" else "trbf_scale"
    for row, (column, value) in enumerate([(width, np.nan), *faults], 3):
        columns[column][row] = value
    for index in range(4):
        columns[f"rot_{index}"][50] = 0
    dropped = [*range(3, 4 + len(faults)), 50]
    words = f"{len(dropped)} of 200 rows.*row 3, {width} = nan.*row 50"
    with pytest.warns(SceneWarning, match=words):
        scene = open_moving(write(tmp_path, columns))
    assert scene.notes.rows_dropped == len(dropped)
    kept = {key: np.delete(values, dropped) for key, values in columns.items()}
    assert_equal(scene.at(0.6 * scene.duration), at(kept, 0.6))
    assert len(scene.resting) == 200 - len(dropped)


@for_each("name", FORMS)
def test_a_file_without_a_row_that_can_be_drawn_or_cut_off_is_refused(name, tmp_path):
    write, columns = FORMS[name][0], copied(FORMS[name][1])
    columns["x"][:] = np.nan
    path = write(tmp_path, columns)
    refuse(path, "no row of 200 can be used.*; export", open_moving)
    path.write_bytes(path.read_bytes()[:-1100])
    refuse(path, "is cut off", open_moving)


@for_each("name", ["omega_2", "motion_8"])
def test_a_column_that_is_missing_is_named(name, tmp_path):
    columns = clips.spacetime_columns(9)
    del columns[name]
    sentence = f"no property '{name}' among .* SpaceTimeGaussian PLY has; export"
    refuse(spacetime(tmp_path, columns), sentence, open_moving)
