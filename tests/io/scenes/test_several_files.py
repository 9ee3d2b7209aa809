"""A scene in several files, of one format or several, named one by one or by their folder."""

from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.doctor import run_doctor
from brushgs.doctor.describe import describe
from brushgs.formats import read_scene
from brushgs.formats.scenes.open_file import find_parts
from brushgs.options.scene_source import SceneSource
from tests.io.ply_maker import scene_columns, write_scene
from tests.scenes import real_scene, still_life_of


def make(path: Path, num_rows: int = 10, degree: int = 0, *comments: str, seed: int = 0, **changes) -> Path:
    """A scene file; `changes` replace columns."""
    path.parent.mkdir(parents=True, exist_ok=True)
    return write_scene(path, scene_columns(num_rows, degree, seed) | changes, comments=comments)


def assert_joined(whole: bg.Gaussians, *parts: bg.Gaussians) -> None:
    """The rows of the parts in order, with zeros in degrees that a part has not."""
    num_terms = max(part.sh.shape[1] for part in parts)
    for name in ("means", "quats", "scales", "opacities"):
        np.testing.assert_array_equal(getattr(whole, name), np.concatenate([getattr(p, name) for p in parts]))
    padded = [np.pad(part.sh, ((0, 0), (0, num_terms - part.sh.shape[1]), (0, 0))) for part in parts]
    np.testing.assert_array_equal(whole.sh, np.concatenate(padded))


# Joining


def test_files_are_joined_in_the_order_given(tmp_path):
    a, b, c = (make(tmp_path / f"{n}.ply", 5 + n, degree, seed=n) for n, degree in enumerate((1, 0, 3)))
    parts = [bg.load(path) for path in (b, c, a)]
    whole, notes = read_scene([b, str(c), a])
    assert_joined(whole, *parts)
    assert (notes.rows_read, notes.rows_dropped, len(whole)) == (18, 0, 18)
    assert (notes.sh_degree_stored, notes.sh_degree_used) == (3, 3)
    assert notes.format == "3 files: PLY, binary little-endian"
    assert notes.files[0] == "1.ply: 6 rows, PLY, binary little-endian"


def test_nothing_is_no_scene():
    with pytest.raises(ValueError, match="scene must name at least one file, got none"):
        bg.load([])


# Where files disagree


UP = "comment up axis: "


def test_different_up_axes_are_told_and_none_is_taken(tmp_path):
    paths = [make(tmp_path / f"{axis}.ply", 3, 0, UP + axis) for axis in ("+z", "-y")]
    with pytest.warns(bg.SceneWarning, match=r"different axes as up, \+z \(\+z\.ply\) and -y \(-y\.ply\)"):
        assert read_scene(paths)[1].up is None


MIP = "comment SplatRenderMode: mip"


@pytest.mark.parametrize(("rows", "antialiased"), [((20, 10), True), ((10, 20), False)])
def test_different_training_is_told_and_that_of_most_gaussians_taken(tmp_path, rows, antialiased):
    paths = make(tmp_path / "a.ply", rows[0], 0, MIP), make(tmp_path / "b.ply", rows[1])
    with pytest.warns(
        bg.SceneWarning, match="trained differently, antialiased .* and default .*; all are drawn as"
    ):
        assert bg.load(paths).antialiased is antialiased


def test_strokes_beside_a_scene_are_a_scene(tmp_path):
    from brushgs.formats.scenes.write import write_scene as save

    for name, is_strokes in (("a", True), ("b", True), ("c", False)):
        save(still_life_of(1000), tmp_path / f"{name}.ply", is_strokes=is_strokes)
    assert read_scene([tmp_path / "a.ply", tmp_path / "b.ply"])[1].is_strokes
    with pytest.warns(bg.SceneWarning, match=r"a\.ply holds strokes of brushgs and other files do not"):
        assert not read_scene([tmp_path / "a.ply", tmp_path / "c.ply"])[1].is_strokes


# Folders


def test_a_folder_is_its_scenes_by_name_and_number(tmp_path):
    folder = tmp_path / "tiles"
    paths = [make(folder / f"tile_{n}.ply", 3 + n, seed=n) for n in (1, 2, 9, 10)]
    make(folder / ".hidden.ply")
    (folder / "cameras.json").write_text("{}")
    make(folder / "deeper" / "another.ply")
    assert find_parts([folder]) == paths
    assert_joined(bg.load(folder), *map(bg.load, paths))


def test_a_folder_without_a_scene_says_what_was_looked_for(tmp_path):
    with pytest.raises(
        bg.SceneError, match=r"is an empty folder: it should hold \.ply.*; name the scene file$"
    ):
        bg.load(tmp_path)
    (tmp_path / "notes.txt").write_text("hello")
    with pytest.raises(
        bg.SceneError, match=r"none of the 1 entries of the folder is \.ply.*; name the scene"
    ):
        bg.load(tmp_path)


def test_the_scene_that_a_trainer_nested_is_named(tmp_path):
    (tmp_path / "cfg_args").write_text("")
    for steps in (7000, 30000):
        make(tmp_path / "point_cloud" / f"iteration_{steps}" / "point_cloud.ply")
    (tmp_path / "training_log.json").write_text('{"loss": 0.1}')  # last by name, but no scene
    with pytest.raises(bg.SceneError, match=r"did you mean .*/iteration_30000/point_cloud\.ply\?"):
        bg.load(tmp_path)


def test_real_scenes_of_two_formats_mix():
    paths = [real_scene("biker.spz"), real_scene("biker.compressed.ply"), real_scene("derived/skull_sh3.ply")]
    whole, notes = read_scene(paths)
    assert_joined(whole, *map(bg.load, paths))
    assert notes.format.startswith("3 files: SPZ")


# Content decides


# Other readers of scenes


def test_info_describes_all_files(tmp_path):
    a, b = make(tmp_path / "t" / "a.ply", 4), make(tmp_path / "t" / "b.ply", 5, label=np.zeros(5))
    facts = describe([a, b])
    assert (facts["gaussians"], facts["not_read"]) == (9, "label")
    assert facts["bytes"] == describe(tmp_path / "t")["bytes"] == a.stat().st_size + b.stat().st_size


def test_the_doctor_cures_all_files_into_one(tmp_path):
    scene = still_life_of(3000)
    for name, rows in (("a", slice(0, 1500)), ("b", slice(1500, None))):
        bg.save(scene.take(rows), tmp_path / f"{name}.ply")
    bg.save(scene, tmp_path / "whole.ply")
    parts = [tmp_path / "a.ply", tmp_path / "b.ply"]
    assert [f.as_dict() for f in bg.examine(parts)] == [
        f.as_dict() for f in bg.examine(tmp_path / "whole.ply")
    ]
    run_doctor(parts, tmp_path / "cured.ply")
    run_doctor(tmp_path / "whole.ply", tmp_path / "cured_whole.ply")
    # All but the name of the scene in the header.
    contents = [
        (tmp_path / name).read_bytes().split(b"end_header\n")[1] for name in ("cured.ply", "cured_whole.ply")
    ]
    assert contents[0] == contents[1]


def linear(columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {f"scale_{i}": np.exp(columns[f"scale_{i}"]) for i in range(3)} | {
        "opacity": 1 / (1 + np.exp(-columns["opacity"]))
    }


def test_the_doctor_refuses_files_in_different_encodings(tmp_path):
    columns = scene_columns(500)
    a = make(tmp_path / "a.ply", 500)
    b = make(tmp_path / "b.ply", 500, **linear(columns))
    with pytest.raises(bg.SceneError, match=r"b\.ply: seems to be encoded in another way than .*a\.ply"):
        bg.examine([a, b])
    (finding, *_) = [f for f in bg.examine([b, b]) if f.severity == "fault"]
    assert (finding.count, finding.share) == (1000, 1)


# The value that stands for a scene


def test_a_folder_gives_its_whole_name(tmp_path, monkeypatch):
    (tmp_path / "scan.v2" / "inner").mkdir(parents=True)
    assert SceneSource.of(f"{tmp_path}/scan.v2/").name == "scan.v2"
    monkeypatch.chdir(tmp_path / "scan.v2")
    assert SceneSource.of(".").name == "scan.v2"
    assert SceneSource.of("meta.json").name == "scan.v2"
    assert SceneSource.of("inner/..").name == "scan.v2"


def test_a_source_keeps_its_level_and_takes_another(tmp_path):
    source = SceneSource.of("a.ply", lod=2)
    assert SceneSource.of(source) == source
    assert SceneSource.of(source, lod=1).lod == 1
    with pytest.raises(ValueError, match="lod must be 0 or more, got -1"):
        SceneSource.of("a.ply", lod=-1)


def test_a_level_of_a_scene_without_levels_is_refused(tmp_path):
    path = make(tmp_path / "a.ply")
    for call in (lambda: bg.load(path, lod=0), lambda: bg.load(SceneSource.of(path, lod=0))):
        with pytest.raises(
            bg.SceneError, match=r"is a PLY file, which has no levels of detail; omit the level"
        ):
            call()


def test_what_must_not_be_replaced_lies_in_folders_too(tmp_path):
    inside = make(tmp_path / "t" / "a.ply")
    assert inside in SceneSource.of(tmp_path / "t").files()
    assert SceneSource.of("no/such.ply").files() == (Path("no/such.ply"),)
