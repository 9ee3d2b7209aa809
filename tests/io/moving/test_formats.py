"""Which paths are moving scenes, which are refused by name, and which are left to the still readers."""

import pickle
import zipfile
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs import SceneError, SceneWarning
from brushgs.formats.moving import load_moving, open_moving
from tests.io.moving import clips
from tests.io.ply_maker import scene_columns, write_scene


def trap(path: Path) -> Path:
    """A file that would be noticed if anyone unpickled it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(pickle.dumps({"weights": [1.0]}, 2))
    return path


def torch_archive(path: Path) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("archive/data.pkl", b"\x80\x02}q\x00.")
        archive.writestr("archive/data/0", bytes(64))
    return path


def model(folder: Path, *names: str) -> Path:
    for name in names:
        if name.endswith(".ply"):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            write_scene(folder / name, scene_columns(4))
        elif name.endswith(".json"):
            (folder / name).write_text('{"anchors": {}, "time_features": {}}')
        else:
            trap(folder / name)
    return folder


REFUSED = {
    "a 4DGaussians folder": (
        lambda folder: model(folder, "point_cloud.ply", "deformation.pth"),
        "4DGaussians model.*network.*export_perframe_3DGS.py.*gaussian_pertimestamp",
    ),
    "a 4DGaussians run": (
        lambda folder: model(folder, "point_cloud/iteration_20000/deformation.pth"),
        "4DGaussians model.*export_perframe_3DGS",
    ),
    "a 4DGaussians network": (lambda folder: trap(folder / "deformation.pth"), "4DGaussians model"),
    "a Deformable-3DGS run": (
        lambda folder: model(folder, "deform/iteration_40000/deform.pth"),
        "Deformable-3DGS or SC-GS model.*network.*save_ply",
    ),
    "a Deformable-3DGS network": (lambda folder: trap(folder / "deform.pth"), "Deformable-3DGS or SC-GS"),
    "a QUEEN run": (
        lambda folder: model(folder, "frames/0001/compressed/point_cloud.pkl"),
        "QUEEN model.*--log_ply",
    ),
    "a GIFStream folder": (lambda folder: model(folder, "meta.json"), "GIFStream model.*network.*PLY"),
    "a checkpoint": (lambda folder: trap(folder / "chkpnt30000.pth"), "is a pickle.*not opened.*PLY"),
    "a pickle of another name": (lambda folder: trap(folder / "scene.data"), "is a pickle.*not opened"),
    "an archive of PyTorch": (lambda folder: torch_archive(folder / "scene.zip"), "is a pickle.*not opened"),
    "a full SpaceTimeGaussian": (
        lambda folder: write_scene(
            folder / "a.ply", clips.spacetime_columns(4) | {"f_t_0": np.zeros(4, np.float32)}
        ),
        "SpaceTimeGaussian PLY of the full model.*network.*ours_lite",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_needs_a_network_or_a_pickle_is_refused_with_the_export_that_works(name, tmp_path, monkeypatch):
    def never(*args: object) -> None:
        raise AssertionError("a pickle was opened")

    for opener in ("load", "loads"):
        monkeypatch.setattr(pickle, opener, never)
    make, message = REFUSED[name]
    path = make(tmp_path)
    with pytest.raises(SceneError, match=message) as error:
        load_moving(path)
    assert str(path) in str(error.value)


def test_a_still_scene_is_none_and_loads_as_a_clip_of_no_length(tmp_path):
    path = write_scene(tmp_path / "a.ply", scene_columns(9, 1))
    assert open_moving(path) is None
    scene = bg.load_moving(path)
    assert isinstance(scene, bg.MovingScene)
    assert (scene.duration, scene.has_rows) == (0, True)
    assert scene.resting is not None
    assert scene.resting.all()
    assert np.array_equal(scene.at(3).sh, bg.load(path).sh)


def test_a_clip_must_be_named_alone(tmp_path):
    clip = write_scene(tmp_path / "a.ply", clips.spacetime_columns(9))
    still = write_scene(tmp_path / "b.ply", scene_columns(9))
    for paths in ([clip, still], [still, clip], [clip, clip]):
        with pytest.raises(SceneError, match="SpaceTimeGaussian PLY, which moves by itself; name it alone"):
            open_moving(paths)


def test_a_clip_has_no_levels(tmp_path):
    from brushgs.options.scene_source import SceneSource

    clip = write_scene(tmp_path / "a.ply", clips.spacetime_columns(9))
    with pytest.raises(SceneError, match=r"no levels of detail; omit the level"):
        open_moving(SceneSource((clip,), lod=1))


def test_gaussians_beside_their_network_are_read_with_a_warning(tmp_path):
    path = model(tmp_path, "point_cloud.ply", "deformation.pth") / "point_cloud.ply"
    with pytest.warns(SceneWarning, match=r"moved by the network beside them.*; name the folder"):
        assert len(load_moving(path).at(0)) == 4


def test_a_ply_header_is_searched_to_its_end_and_no_further(tmp_path):
    columns = clips.spacetime_columns(5)
    long = write_scene(tmp_path / "a.ply", columns, comments=[f"comment {'x' * 500}"] * 100)
    assert open_moving(long) is not None
    path = write_scene(tmp_path / "b.ply", scene_columns(5))
    names = b"".join(b"\nproperty float %s" % name.encode() for name in columns)
    path.write_bytes(path.read_bytes() + names)
    assert open_moving(path) is None
