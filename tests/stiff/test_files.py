"""Stiff and hostile files: read rightly, dropped and counted, or refused; what was read can be painted."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs import SceneError, SceneWarning
from brushgs.formats import load, read_scene
from tests.io.ply_maker import scene_columns, write_scene
from tests.stiff.scenes import orbit
from tests.stiff.test_pictures import TEXTURES, assert_finite

LEGITIMATE = {("opacity", np.inf), ("opacity", -np.inf)} | {(f"scale_{i}", -np.inf) for i in range(3)}
UNUSED = {"nx", "ny", "nz"}


def paint(gaussians: bg.Gaussians) -> None:
    """Through prune, cluster, project and rasterise, in both orders."""
    strokes = bg.cluster(bg.prune(gaussians), max(1, len(gaussians) // 2))
    for scene, order in ((gaussians, "depth"), (strokes, "soft")):
        assert_finite(bg.render(scene, orbit()[0], TEXTURES["image"], order=order))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", scene_columns(1, degree=1))
def test_nan_or_infinity_in_any_column_is_dropped_and_counted_where_it_means_nothing(
    tmp_path: Path, name, value
):
    columns = scene_columns(20, degree=1)
    columns[name][[3, 11]] = value
    path = write_scene(tmp_path / "a.ply", columns)
    if name in UNUSED or (name, value) in LEGITIMATE:
        gaussians, notes = read_scene(path)
        assert (len(gaussians), notes.rows_dropped) == (20, 0)
    elif name.startswith("f_rest"):
        with pytest.warns(SceneWarning, match=rf"in 2 of 20 rows .*count as 0 .*row 3, {name} = {value:g}"):
            gaussians, notes = read_scene(path)
        assert (len(gaussians), notes.rows_dropped) == (20, 0)
    else:
        with pytest.warns(
            SceneWarning, match=rf"2 of 20 rows were dropped: 2 hold .*row 3, {name} = {value:g}"
        ):
            gaussians, notes = read_scene(path)
        assert (len(gaussians), notes.rows_dropped) == (18, 2)
    paint(gaussians)


def test_opacity_one_and_scale_zero_are_painted_as_what_they_are(tmp_path: Path):
    columns = scene_columns(20)
    columns["opacity"][:] = np.inf
    columns["scale_1"][:] = -np.inf
    gaussians = load(write_scene(tmp_path / "a.ply", columns))
    assert (gaussians.opacities == 1).all()
    assert (gaussians.scales[:, 1] == 0).all()
    assert bg.render(gaussians, orbit()[0], bg.StrokeTexture.open("gaussian")).alpha.max() > 0.9
    paint(gaussians)


def test_zero_quaternions_are_dropped_and_others_normalised_where_used(tmp_path: Path):
    columns = scene_columns(20)
    for i in range(4):
        columns[f"rot_{i}"][5:9] = 0
        columns[f"rot_{i}"][10:] *= np.float32(1e30)
    with pytest.warns(SceneWarning, match=r"4 of 20 rows .* 4 have an all-zero rotation"):
        gaussians = load(write_scene(tmp_path / "a.ply", columns))
    assert len(gaussians) == 16
    paint(gaussians)


def test_nine_hundred_thousand_all_zero_rows_beside_a_scene(tmp_path: Path):
    columns = {name: np.zeros(900_050, np.float32) for name in scene_columns(1) if name not in UNUSED}
    for name, values in scene_columns(50).items():
        if name in columns:
            columns[name][900_000:] = values
    path = write_scene(tmp_path / "a.ply", columns)
    with pytest.warns(SceneWarning, match=r"900000 of 900050 rows .* all-zero rotation, as padding rows do"):
        gaussians = load(path)
    assert len(gaussians) == 50
    paint(gaussians)
    nothing = write_scene(tmp_path / "b.ply", {name: values[:1000] for name, values in columns.items()})
    with pytest.raises(SceneError, match="no row of 1000 can be used"):
        load(nothing)


@pytest.mark.parametrize(
    "fault", ["linear scales", "opacities as they are", "xyzw quaternions", "colors to 255"]
)
def test_columns_in_another_encoding_are_loaded_and_painted_finite(tmp_path: Path, fault):
    """What is meant cannot be known here: `brushgs doctor` names it and cures it when asked."""
    columns = scene_columns(60)
    if fault == "linear scales":  # read as logs, all are about 1: every stroke covers the others
        for i in range(3):
            columns[f"scale_{i}"] = np.exp(columns[f"scale_{i}"])
    elif fault == "opacities as they are":
        columns["opacity"] = 1 / (1 + np.exp(-columns["opacity"]))
    elif fault == "xyzw quaternions":
        rotations = [columns[f"rot_{i}"] for i in (1, 2, 3, 0)]
        columns.update({f"rot_{i}": rotation for i, rotation in enumerate(rotations)})
    else:
        for i in range(3):
            columns[f"f_dc_{i}"] = 127 + 30 * columns[f"f_dc_{i}"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SceneWarning)  # whether it is reported is up to the doctor
        gaussians = load(write_scene(tmp_path / "a.ply", columns))
    assert len(gaussians) == 60
    paint(gaussians)


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_every_encoding_and_degree_is_painted_alike(tmp_path: Path, encoding, degree):
    columns = scene_columns(30, degree)
    gaussians = load(write_scene(tmp_path / "a.ply", columns, encoding))
    other = load(write_scene(tmp_path / "b.ply", columns))
    assert gaussians.sh_degree == degree
    one, two = (bg.render(scene, orbit()[0], TEXTURES["image"]).rgb for scene in (gaussians, other))
    np.testing.assert_array_equal(one, two)
    paint(gaussians)
