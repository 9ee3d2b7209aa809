"""Moments of strokes as files: all or nothing, nobody else's files are lost, and they read back."""

import numpy as np
import pytest

from brushgs.errors import SceneError
from brushgs.formats.moving import load_moving
from brushgs.formats.moving.write import NAME, check_moments_folder, write_moments
from brushgs.formats.scenes.write import write_scene
from brushgs.values.gaussians import Gaussians
from tests.kit.refusals import refuse
from tests.passes.scenes import random_gaussians


def moments(num, *, num_strokes=40, step=0.1):
    """The first half of the strokes moves along x."""
    strokes = random_gaussians(num_strokes, 3).astype(np.float32)
    for index in range(num):
        means = strokes.means.copy()
        means[: num_strokes // 2, 0] += step * index
        yield Gaussians(means, strokes.quats, strokes.scales, strokes.opacities, strokes.sh, brushes=None)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_moments_read_back_as_a_clip_whose_rows_correspond(tmp_path):
    folder = tmp_path / "strokes"
    size = write_moments(moments(5), folder, scene="pears", brushes=())
    assert names(folder) == [NAME % index for index in range(5)]
    assert size == sum(path.stat().st_size for path in folder.iterdir())
    clip = load_moving(folder)
    assert (clip.has_rows, clip.duration) == (True, pytest.approx(5 / 24))
    assert clip.notes.is_strokes
    assert clip.notes.scene == "pears"
    for index, strokes in enumerate(moments(5)):
        read = clip.at(index / 24)
        for name, column in strokes.columns().items():
            np.testing.assert_allclose(getattr(read, name), column, rtol=1e-5, atol=1e-6, err_msg=name)


def test_fewer_moments_replace_more_and_hidden_files_stay(tmp_path):
    write_moments(moments(6), tmp_path)
    (tmp_path / ".DS_Store").write_bytes(b"hidden")
    check_moments_folder(tmp_path)
    write_moments(moments(2, step=0.5), tmp_path)
    assert names(tmp_path) == [".DS_Store", NAME % 0, NAME % 1]
    assert load_moving(tmp_path).duration == pytest.approx(2 / 24)


@pytest.mark.parametrize("is_new", [True, False])
def test_what_fails_midway_leaves_the_folder_as_it_was(tmp_path, is_new):
    folder = tmp_path / "strokes"
    if not is_new:
        write_moments(moments(3), folder)
    before = {} if is_new else {path.name: path.read_bytes() for path in folder.iterdir()}

    def fail(error):
        yield from moments(2, step=0.7)
        raise error

    for error in (KeyboardInterrupt(), MemoryError()):
        with pytest.raises(type(error)):
            write_moments(fail(error), folder)
    with pytest.raises(SceneError, match=r"strokes: cannot be written \(No space left on device\)"):
        write_moments(fail(OSError(28, "No space left on device")), folder)
    after = {path.name: path.read_bytes() for path in folder.iterdir()} if folder.exists() else {}
    assert after == before
    assert folder.exists() is not is_new


def test_a_folder_with_anything_else_is_refused_and_missing_folders_are_made(tmp_path):
    write_scene(next(moments(1)), tmp_path / "00000.ply")  # a scene that someone trained
    for name in ("00000.ply", "notes.txt", "moment_00000.txt"):
        folder = tmp_path / "folders" / name
        folder.mkdir(parents=True)
        (folder / name).write_bytes((tmp_path / "00000.ply").read_bytes())
        refuse(folder, f"holds {name}, which brushgs did not write", check_moments_folder)
    refuse(tmp_path / "00000.ply", "is a file, not a folder; choose another name", check_moments_folder)
    write_moments(moments(1), tmp_path / "none" / "strokes")
    assert names(tmp_path / "none" / "strokes") == [NAME % 0]
