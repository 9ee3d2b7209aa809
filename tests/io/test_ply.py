import numpy as np
import pytest

import brushgs as bg
import brushgs.formats.scenes.ply_inria
import brushgs.formats.scenes.rows
from brushgs import Gaussians, SceneWarning
from brushgs.formats import load, read_scene
from tests.io.ply_maker import decoded, element_bytes, scene_columns, write_ply_file, write_scene
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse

# exp and the logistic function in float32: a few units in the last place.
RTOL = 4 * np.finfo(np.float32).eps


def assert_is(gaussians: Gaussians, expected: dict[str, np.ndarray]) -> None:
    for name, values in expected.items():
        actual = getattr(gaussians, name)
        assert actual.dtype == np.float32
        rtol = RTOL if name in ("scales", "opacities") else 0
        np.testing.assert_allclose(actual, values, rtol=rtol, atol=0, err_msg=name)


@for_each("degree", [0, 1, 2, 3])
@for_each("encoding", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_a_scene_reads_as_it_is_defined(tmp_path, degree, encoding):
    columns = scene_columns(50, degree)
    gaussians, notes = read_scene(write_scene(tmp_path / "a.ply", columns, encoding))
    assert_is(gaussians, decoded(columns))
    assert (notes.rows_read, notes.rows_dropped, notes.up) == (50, 0, None)
    assert (notes.sh_degree_stored, notes.sh_degree_used) == (degree, degree)


@for_each("encoding", ["ascii", "binary_little_endian"])
def test_properties_are_found_by_name_and_others_of_any_type_are_skipped(tmp_path, encoding):
    columns = scene_columns(20, degree=3)
    kinds = ["char", "uchar", "short", "ushort", "int", "uint", "double"]
    mixed = {}
    for index, name in enumerate(np.random.default_rng(5).permutation(list(columns)).tolist()):
        if name not in ("nx", "ny", "nz"):
            mixed |= {name: columns[name], f"extra:{index}": np.arange(20)}
    types = {f"extra:{index}": kinds[index % 7] for index in range(len(columns))}
    header, data = element_bytes("vertex", mixed, encoding, types)
    if encoding == "ascii":  # blank lines are skipped
        data = b"\n" + data.replace(b"\n", b" \n\n")
    path = write_ply_file(tmp_path / "a.ply", [(header, data)], encoding)
    assert_is(load(path), decoded(columns))
    if encoding != "ascii":
        path.write_bytes(path.read_bytes() + b"12345")
        words = "5 bytes after the last row were ignored; .* get it again in binary"
        with pytest.warns(SceneWarning, match=words):
            assert_is(load(path), decoded(columns))


@for_each(
    ("comment", "up"),
    [
        ("comment Vertical Axis: z", "+z"),
        ("comment up axis = -Y", "-y"),
        ("obj_info up_axis x", "+x"),
        ("comment Vertical axis: y", None),
        ("comment Vertical axis: +y", "+y"),
    ],
)
def test_a_comment_may_state_the_axis_that_points_up(tmp_path, comment, up):
    assert read_scene(write_scene(tmp_path / "a.ply", scene_columns(3), comments=[comment]))[1].up == up


BROKEN = {"z": np.inf, "rot_2": -np.inf, "scale_0": np.inf, "scale_1": 100}
BROKEN |= dict.fromkeys(("y", "scale_2", "opacity", "f_dc_1"), np.nan)


@for_each("name, value", BROKEN.items())
def test_a_row_that_cannot_be_drawn_is_dropped_and_named(tmp_path, name, value):
    columns = scene_columns(50, degree=3)
    columns[name][[7, 31]] = value
    path = write_scene(tmp_path / "a.ply", columns)
    what = rf"a\.ply: 2 of 50 rows were dropped: 2 hold .* \(first: row 7, {name} = {value:g}\)"
    with pytest.warns(SceneWarning, match=what):
        gaussians, notes = read_scene(path)
    assert (notes.rows_read, notes.rows_dropped) == (50, 2)
    assert_is(gaussians, {k: np.delete(v, [7, 31], axis=0) for k, v in decoded(columns).items()})


def test_logits_of_full_paint_logs_of_nothing_and_normals_without_a_number_cost_no_row(tmp_path):
    columns = scene_columns(20)
    columns["opacity"][:9], columns["opacity"][9:] = np.inf, -np.inf
    columns["scale_1"][:] = -np.inf
    columns["nx"][:] = np.nan
    gaussians = load(write_scene(tmp_path / "a.ply", columns))
    assert gaussians.opacities.tolist() == [1] * 9 + [0] * 11
    assert (gaussians.scales[:, 1] == 0).all()


@for_each("value", [np.nan, np.inf, -np.inf])
def test_a_broken_view_dependent_coefficient_counts_as_zero_and_costs_no_row(tmp_path, value):
    columns = scene_columns(50, degree=3)
    sound = {name: column.copy() for name, column in columns.items()}
    for row, name in ((7, "f_rest_40"), (31, "f_rest_0"), (31, "f_rest_44")):
        columns[name][row], sound[name][row] = value, 0
    path = write_scene(tmp_path / "a.ply", columns)
    what = rf"a\.ply: in 2 of 50 rows view-dependent colors .* \(first: row 7, f_rest_40 = {value:g}\)"
    with pytest.warns(SceneWarning, match=what):
        gaussians, notes = read_scene(path)
    assert (notes.rows_read, notes.rows_dropped) == (50, 0)
    assert_is(gaussians, decoded(sound))
    (finding,) = [one for one in bg.examine(path) if one.name == "non-finite-colors"]
    assert (finding.severity, finding.count, finding.facts["column"]) == ("odd", 2, "f_rest_40")


def test_padding_rows_are_dropped_and_counted_apart_from_broken_ones(tmp_path):
    columns = scene_columns(50)
    for values in columns.values():
        values[20:40] = 0
    columns["x"][3] = np.nan
    path = write_scene(tmp_path / "a.ply", columns)
    what = r"21 of 50 rows .*: 1 hold .* and 20 have an all-zero rotation, .* \(first: row 20\)"
    with pytest.warns(SceneWarning, match=what):
        assert len(load(path)) == 29


def test_a_scene_without_one_good_row_is_refused(tmp_path):
    columns = scene_columns(5)
    columns["scale_0"][:] = np.nan
    sentence = r"a\.ply: no row of 5 can be used: 5 hold .*; export the scene again"
    refuse(write_scene(tmp_path / "a.ply", columns), sentence)


@pytest.mark.parametrize("num_threads", [1, 2, 4])
def test_blocks_and_threads_do_not_change_what_is_read(tmp_path, monkeypatch, num_threads):
    columns = scene_columns(1000, degree=2)
    bad = np.sort(np.random.default_rng(1).permutation(1000)[:300])
    columns["x"][bad[:100]] = np.nan
    for index in range(4):
        columns[f"rot_{index}"][bad[100:]] = 0
    path = write_scene(tmp_path / "a.ply", columns)
    monkeypatch.setattr(brushgs.formats.scenes.ply_inria, "_BLOCK_BYTES", 41 * 37)
    monkeypatch.setattr(brushgs.formats.scenes.rows, "_count_threads", lambda num_rows: num_threads)
    broken, padding = (rf"\(first: row {rows}\)" for rows in (f"{bad[0]}, x = nan", bad[100]))
    with pytest.warns(SceneWarning, match=rf"300 of 1000 rows .* 100 hold .* {broken} and 200 .* {padding}"):
        gaussians = load(path)
    assert_is(gaussians, {k: np.delete(v, bad, axis=0) for k, v in decoded(columns).items()})


def test_scales_and_opacities_stored_without_log_and_logit_are_reported(tmp_path):
    columns = scene_columns(50)
    for index in range(3):
        columns[f"scale_{index}"] = np.exp(columns[f"scale_{index}"])
    columns["opacity"] = np.random.default_rng(1).random(50).astype(np.float32)
    path = write_scene(tmp_path / "a.ply", columns)
    words = r"a\.ply: scales and opacities seem to be stored in another .*; 'brushgs doctor .*a\.ply"
    with pytest.warns(SceneWarning, match=words):
        load(path)
    columns["opacity"][7] = 1.1
    load(write_scene(tmp_path / "b.ply", columns))  # one logit above 1 proves them to be logits
