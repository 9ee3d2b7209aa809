"""A scene in several files, of one format or several, named one by one or by their folder."""

from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.doctor import run_doctor
from brushgs.doctor.describe import describe
from brushgs.formats import read_scene
from brushgs.formats.scenes.open_file import find_parts
from brushgs.formats.scenes.write import write_scene as save
from brushgs.options.scene_source import SceneSource
from tests.io.ply_maker import scene_columns, write_scene
from tests.kit.refusals import refuse
from tests.scenes import real_scene, still_life_of


def make(path, num_rows=10, degree=0, *comments, seed=0, **changes):
    """A scene file; `changes` replace columns."""
    path.parent.mkdir(parents=True, exist_ok=True)
    return write_scene(path, scene_columns(num_rows, degree, seed) | changes, comments=comments)


def assert_joined(whole, *parts):
    """The rows of the parts in order, with zeros in degrees that a part has not."""
    num_terms = max(part.sh.shape[1] for part in parts)
    for name in ("means", "quats", "scales", "opacities"):
        np.testing.assert_array_equal(getattr(whole, name), np.concatenate([getattr(p, name) for p in parts]))
    padded = [np.pad(part.sh, ((0, 0), (0, num_terms - part.sh.shape[1]), (0, 0))) for part in parts]
    np.testing.assert_array_equal(whole.sh, np.concatenate(padded))


def test_files_are_joined_in_the_order_given(tmp_path):
    a, b, c = (make(tmp_path / f"{n}.ply", 5 + n, degree, seed=n) for n, degree in enumerate((1, 0, 3)))
    whole, notes = read_scene([b, str(c), a])
    assert_joined(whole, *(bg.load(path) for path in (b, c, a)))
    assert (notes.rows_read, notes.rows_dropped, len(whole)) == (18, 0, 18)
    assert (notes.sh_degree_stored, notes.sh_degree_used) == (3, 3)
    assert notes.format == "3 files: PLY, binary little-endian"
    assert notes.files[0] == "1.ply: 6 rows, PLY, binary little-endian"
    with pytest.raises(ValueError, match="scene must name at least one file, got none"):
        bg.load([])


def test_real_scenes_of_two_formats_mix():
    paths = [real_scene("biker.spz"), real_scene("derived/skull_sh3.ply")]
    whole, notes = read_scene(paths)
    assert_joined(whole, *map(bg.load, paths))
    assert notes.format.startswith("2 files: SPZ")


def test_where_files_disagree_it_is_told(tmp_path):
    axes = [make(tmp_path / f"{axis}.ply", 3, 0, f"comment up axis: {axis}") for axis in ("+z", "-y")]
    with pytest.warns(bg.SceneWarning, match=r"different axes as up, \+z \(\+z\.ply\) and -y \(-y\.ply\)"):
        assert read_scene(axes)[1].up is None
    for rows, antialiased in (((20, 10), True), ((10, 20), False)):  # that of most Gaussians is taken
        mip = make(tmp_path / "a.ply", rows[0], 0, "comment SplatRenderMode: mip")
        words = "trained differently, antialiased .* and default .*; all are drawn as"
        with pytest.warns(bg.SceneWarning, match=words):
            assert bg.load((mip, make(tmp_path / "b.ply", rows[1]))).antialiased is antialiased
    a, b, c = (tmp_path / f"{name}.ply" for name in "abc")
    for path in (a, b, c):
        save(still_life_of(1000), path, is_strokes=path != c)
    assert read_scene([a, b])[1].is_strokes
    with pytest.warns(bg.SceneWarning, match=r"a\.ply holds strokes of brushgs and other files do not"):
        assert not read_scene([a, c])[1].is_strokes


# Folders


def test_a_folder_is_its_scenes_by_name_and_number(tmp_path, monkeypatch):
    folder = tmp_path / "tiles"
    paths = [make(folder / f"tile_{n}.ply", 3 + n, seed=n) for n in (1, 2, 9, 10)]
    make(folder / ".hidden.ply")
    (folder / "cameras.json").write_text("{}")
    make(folder / "deeper" / "another.ply")
    assert find_parts([folder]) == paths
    assert_joined(bg.load(folder), *map(bg.load, paths))
    assert paths[0] in SceneSource.of(folder).files()  # what must not be replaced
    assert SceneSource.of("no/such.ply").files() == (Path("no/such.ply"),)


def test_a_folder_without_a_scene_says_what_was_looked_for_and_where_a_scene_is(tmp_path):
    refuse(tmp_path, r"is an empty folder: it should hold \.ply.*; name the scene file$")
    (tmp_path / "cfg_args").write_text("")
    refuse(tmp_path, r"none of the 1 entries of the folder is \.ply.*; name the scene")
    for steps in (7000, 30000):
        make(tmp_path / "point_cloud" / f"iteration_{steps}" / "point_cloud.ply")
    (tmp_path / "training_log.json").write_text('{"loss": 0.1}')  # last by name, but no scene
    refuse(tmp_path, r"did you mean .*/iteration_30000/point_cloud\.ply\?")


# Other readers of scenes


def test_info_describes_all_files(tmp_path):
    a, b = make(tmp_path / "t" / "a.ply", 4), make(tmp_path / "t" / "b.ply", 5, label=np.zeros(5))
    facts = describe([a, b])
    assert (facts["gaussians"], facts["not_read"]) == (9, "label")
    assert facts["bytes"] == describe(tmp_path / "t")["bytes"] == a.stat().st_size + b.stat().st_size


def test_the_doctor_cures_all_files_into_one_and_refuses_different_encodings(tmp_path):
    scene, whole = still_life_of(3000), tmp_path / "whole.ply"
    parts = [tmp_path / "a.ply", tmp_path / "b.ply"]
    for path, rows in zip(parts, (slice(0, 1500), slice(1500, None)), strict=True):
        bg.save(scene.take(rows), path)
    bg.save(scene, whole)
    assert [f.as_dict() for f in bg.examine(parts)] == [f.as_dict() for f in bg.examine(whole)]
    run_doctor(parts, tmp_path / "cured.ply")
    run_doctor(whole, tmp_path / "cured_whole.ply")
    contents = [(tmp_path / name).read_bytes() for name in ("cured.ply", "cured_whole.ply")]
    first, second = (content.split(b"end_header\n")[1] for content in contents)  # headers name the scene
    assert first == second
    columns = scene_columns(500)
    linear = {f"scale_{i}": np.exp(columns[f"scale_{i}"]) for i in range(3)}
    linear["opacity"] = 1 / (1 + np.exp(-columns["opacity"]))
    a, b = make(tmp_path / "a.ply", 500), make(tmp_path / "b.ply", 500, **linear)
    with pytest.raises(bg.SceneError, match=r"b\.ply: seems to be encoded in another way than .*a\.ply"):
        bg.examine([a, b])
    (finding, *_) = [f for f in bg.examine([b, b]) if f.severity == "fault"]
    assert (finding.count, finding.share) == (1000, 1)


# The value that stands for a scene


def test_a_source_has_the_name_of_its_folder_and_keeps_its_level(tmp_path, monkeypatch):
    (tmp_path / "scan.v2" / "inner").mkdir(parents=True)
    assert SceneSource.of(f"{tmp_path}/scan.v2/").name == "scan.v2"
    monkeypatch.chdir(tmp_path / "scan.v2")
    for path in (".", "meta.json", "inner/.."):
        assert SceneSource.of(path).name == "scan.v2"
    source = SceneSource.of("a.ply", lod=2)
    assert SceneSource.of(source) == source
    assert SceneSource.of(source, lod=1).lod == 1
    with pytest.raises(ValueError, match="lod must be 0 or more, got -1"):
        SceneSource.of("a.ply", lod=-1)
    refuse(make(tmp_path / "a.ply"), "is a PLY file, which has no levels of detail; omit the level", lod=0)
