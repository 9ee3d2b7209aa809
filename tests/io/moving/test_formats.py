"""Which paths are moving scenes, which are refused by name, and which are left to the still readers."""

import pickle
import zipfile

import numpy as np
import pytest

import brushgs as bg
from brushgs import SceneError, SceneWarning
from brushgs.formats.moving import load_moving, open_moving
from brushgs.options.scene_source import SceneSource
from tests.io.moving import clips
from tests.io.ply_maker import scene_columns, write_scene
from tests.kit.for_each import for_each


def model(folder, *names):
    """Files of a model; pickles would be noticed if anyone opened them."""
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        if name.endswith(".ply"):
            write_scene(folder / name, scene_columns(4))
        elif name.endswith(".json"):
            (folder / name).write_text('{"anchors": {}, "time_features": {}}')
        elif name.endswith(".zip"):
            with zipfile.ZipFile(folder / name, "w") as archive:
                archive.writestr("archive/data.pkl", b"\x80\x02}q\x00.")
        else:
            (folder / name).write_bytes(pickle.dumps({"weights": [1.0]}, 2))
    return folder


# Files of a model, which of them is named (the folder where none is), and the sentence.
REFUSED = [
    (["point_cloud.ply", "deformation.pth"], "", "4DGaussians model.*network.*export_perframe_3DGS.py"),
    (["point_cloud/iteration_20000/deformation.pth"], "", "4DGaussians model.*export_perframe_3DGS"),
    (["deformation.pth"], "deformation.pth", "4DGaussians model"),
    (["deform/iteration_40000/deform.pth"], "", "Deformable-3DGS or SC-GS model.*network.*save_ply"),
    (["deform.pth"], "deform.pth", "Deformable-3DGS or SC-GS"),
    (["frames/0001/compressed/point_cloud.pkl"], "", "QUEEN model.*--log_ply"),
    (["meta.json"], "", "GIFStream model.*network.*PLY"),
    (["chkpnt30000.pth"], "chkpnt30000.pth", "is a pickle.*not opened.*PLY"),
    (["scene.data"], "scene.data", "is a pickle.*not opened"),
    (["scene.zip"], "scene.zip", "is a pickle.*not opened"),
]


@for_each("names, named, sentence", REFUSED)
def test_what_needs_a_network_or_a_pickle_is_refused_with_a_cure(names, named, sentence, tmp_path):
    folder = tmp_path / names[0].replace("/", "-")
    folder.mkdir(exist_ok=True)
    path = model(folder / str(len(names)), *names) / named
    with pytest.MonkeyPatch.context() as patch:
        for opener in ("load", "loads"):
            patch.setattr(pickle, opener, lambda *args: pytest.fail("a pickle was opened"))
        with pytest.raises(SceneError, match=sentence) as error:
            load_moving(path)
    assert str(path) in str(error.value)


def test_the_full_spacetimegaussian_is_refused(tmp_path):
    columns = clips.spacetime_columns(4) | {"f_t_0": np.zeros(4, np.float32)}
    with pytest.raises(SceneError, match=r"SpaceTimeGaussian PLY of the full model.*network.*ours_lite"):
        load_moving(write_scene(tmp_path / "a.ply", columns))


def test_a_still_scene_is_none_and_loads_as_a_clip_of_no_length(tmp_path):
    path = write_scene(tmp_path / "a.ply", scene_columns(9, 1))
    assert open_moving(path) is None
    scene = bg.load_moving(path)
    assert (scene.duration, scene.has_rows) == (0, True)
    assert scene.resting.all()
    assert np.array_equal(scene.at(3).sh, bg.load(path).sh)


def test_a_clip_is_named_alone_and_has_no_levels(tmp_path):
    clip = write_scene(tmp_path / "a.ply", clips.spacetime_columns(9))
    still = write_scene(tmp_path / "b.ply", scene_columns(9))
    for paths in ([clip, still], [still, clip], [clip, clip]):
        with pytest.raises(SceneError, match="SpaceTimeGaussian PLY, which moves by itself; name it alone"):
            open_moving(paths)
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
