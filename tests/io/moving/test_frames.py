"""Moving scenes in a file a moment."""

import pickle
import warnings
import weakref
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats import read_scene
from brushgs.formats.moving import load_moving, open_moving
from brushgs.formats.moving.frames import Frames
from brushgs.formats.scenes.write import write_scene as save_scene
from brushgs.options.scene_source import SceneSource
from brushgs.values.correspondence import have_same_rows
from tests.io.moving.frame_maker import columns_at, shuffled, write_frames
from tests.io.ply_maker import decoded, scene_columns, write_scene
from tests.kit.for_each import for_each
from tests.passes.scenes import assert_same
from tests.scenes import still_life_of


def opened(scene):
    moving = open_moving(scene)
    assert moving is not None
    return moving


def fails(sentence, call, *arguments):
    with pytest.raises(bg.SceneError, match=sentence):
        call(*arguments)


def nothing(path):
    return write_scene(path, {name: values[:0] for name, values in scene_columns(1).items()})


# A clip, or one scene in parts


@for_each("name", ["frame_{:03}.ply", "dance_{}.ply", "{:04}.ply"])
def test_a_folder_of_numbered_files_is_a_clip(tmp_path, name):
    paths = write_frames(tmp_path / name, range(12), name)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*lie in one place")
        moving = opened(tmp_path / name)
    assert (moving.duration, moving.has_rows, moving.resting) == (12 / 24, True, None)
    np.testing.assert_allclose(moving.times, np.arange(12) / 24)
    for index in (0, 3, 11):
        assert_same(moving.at(index / 24), bg.load(paths[index]))
    assert moving.notes.format == "12 moments at 24 a second, PLY, binary little-endian"


CLIPS = [("frame_{}.ply", 100), ("scan_{}.ply", 0.5), ("{}.ply", 0)]
OTHERS = [("tile_{}.ply", 0), ("scan_{}.ply", 4), ("{}.ply", 100)]


@for_each("name, apart, is_clip", [(*row, row in CLIPS) for row in CLIPS + OTHERS])
def test_names_decide_and_then_places(tmp_path, name, apart, is_clip):
    folder = tmp_path / f"{name} {apart}"
    folder.mkdir()
    for index in range(4):
        columns = scene_columns(300, seed=index)
        columns["x"] = (columns["x"] + apart * index).astype(np.float32)
        write_scene(folder / name.format(index), columns)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert (open_moving(folder) is not None) is is_clip
    is_told = is_clip and "frame" not in name
    assert ["lie in one place" in str(w.message) for w in caught] == [True] * is_told
    assert ["--time all" in str(w.message) for w in caught] == [True] * is_told


def test_levels_of_detail_and_pairs_are_no_clips(tmp_path):
    for index, count in enumerate((800, 400, 200)):
        write_scene(tmp_path / f"scan_{index}.ply", scene_columns(count))
    assert open_moving(tmp_path) is None
    paths = write_frames(tmp_path, range(2), "left_{}.ply")
    assert open_moving(paths) is None
    assert len(bg.load(paths)) == 400


def test_a_clip_of_many_names_is_hardly_opened(tmp_path, monkeypatch):
    """Its files are links to one that is there, or that was never copied."""
    (frame,) = write_frames(tmp_path / "there", [0])
    folder = tmp_path / "clip"
    folder.mkdir()
    for number in range(2000):
        there = number % 100 or number == 0
        (folder / f"frame_{10 * number:06}.ply").symlink_to(frame if there else tmp_path / "gone.ply")
    opened_paths = []
    open_path = Path.open

    def counted(self, *args, **options):
        opened_paths.append(self)
        return open_path(self, *args, **options)

    monkeypatch.setattr(Path, "open", counted)
    with pytest.warns(bg.SceneWarning, match=r"clip: 19 of 2,000 moments are missing by their numbers"):
        moving = opened(folder)
    assert moving.duration == 2000 / 24
    assert len(moving.at(100 / 24)) == 200
    assert len(opened_paths) < 200


# Do rows correspond?


def test_rows_in_any_other_order_do_not_correspond():
    scene = still_life_of(3000)

    def along_x(some):
        return some.take(np.argsort(some.means[:, 0], kind="stable"))

    def without(share, seed):
        rows = np.random.default_rng(seed).permutation(len(scene))[round(share * len(scene)) :]
        return scene.take(np.sort(rows))

    for count in (1, 2, 3, len(scene)):
        assert have_same_rows(scene.take(slice(0, count)), scene.take(slice(0, count)))
    lost, ordered = [without(0.03, seed) for seed in (1, 2)], along_x(scene)
    shuffle = np.random.default_rng(0).permutation(len(scene))
    others = [(scene, scene.take(rows)) for rows in (shuffle, slice(None, None, -1), slice(1, None))]
    others += [(ordered, along_x(scene.take(slice(0, -1)))), lost, [along_x(some) for some in lost]]
    for one, other in (*others, [ordered.take(slice(first, None, 2)) for first in (0, 1)]):
        assert not have_same_rows(one, other)


def test_frames_of_other_counts_and_formats_have_no_rows(tmp_path):
    write_frames(tmp_path, range(5), columns=lambda moment: columns_at(moment, 100 + int(moment)))
    rows = np.zeros(200, [("a", "<f4", 6), ("b", "u1", 8)])
    rng = np.random.default_rng(0)
    rows["a"], rows["b"] = rng.random((200, 6)), rng.integers(1, 255, (200, 8))
    (tmp_path / "frame_005.splat").write_bytes(rows.tobytes())
    moving = opened(tmp_path)
    assert not moving.has_rows
    assert [len(moving.at(moment / 24)) for moment in range(6)] == [100, 101, 102, 103, 104, 200]


# Moments, and what lies between


def test_between_moments_rows_lie_on_a_line_and_turn_the_shorter_way(tmp_path):
    paths = write_frames(tmp_path, range(3))
    flipped = columns_at(1)
    for index in range(4):
        flipped[f"rot_{index}"] *= -1  # the same rotation
    write_scene(paths[1], flipped)
    moving = opened(tmp_path)
    one, other = (decoded(columns_at(moment)) for moment in (0, 1))
    found = moving.at(0.25 / 24)
    for name in ("means", "scales", "opacities", "sh"):
        expected = 0.75 * one[name] + 0.25 * other[name]
        np.testing.assert_allclose(getattr(found, name), expected, rtol=1e-5, atol=1e-6, err_msg=name)
    turn = decoded(columns_at(0.25))["quats"]
    lengths = np.linalg.norm(turn, axis=1) * np.linalg.norm(found.quats, axis=1)
    np.testing.assert_allclose(np.abs(np.sum(found.quats * turn, axis=1)), lengths, rtol=1e-6)
    assert_same(pickle.loads(pickle.dumps(moving)).at(0.25 / 24), found)
    for outside, end in ((-1, 0), (9, 2)):
        assert_same(moving.at(outside), bg.load(paths[end]))
    with pytest.raises(ValueError, match="time must be a number"):
        moving.at(float("nan"))


def test_a_clip_that_is_read_through_never_has_more_than_three_moments_in_memory(tmp_path, monkeypatch):
    write_frames(tmp_path, range(30), columns=lambda moment: columns_at(moment, 50))
    living, most, read = weakref.WeakSet(), 0, Frames._read

    def counted(self, index):
        nonlocal most
        kept = read(self, index)
        living.add(kept.gaussians)
        most = max(most, len(living))
        return kept

    monkeypatch.setattr(Frames, "_read", counted)
    moving = opened(tmp_path)
    for time in np.arange(0, 29.5, 0.5) / 24:
        found = moving.at(time)
        most = max(most, len({found, *living}))
    assert most <= 3
    assert len(living) <= 2


@for_each("empty", [(0,), (2,), (0, 1), (2, 3), (4,)])
def test_where_rows_correspond_an_empty_moment_has_all_of_them_unseen(tmp_path, empty):
    paths = write_frames(tmp_path, range(5))
    for index in empty:
        nothing(paths[index])
    moving = opened(tmp_path)
    assert moving.has_rows
    for index in range(5):
        found = moving.at(index / 24)
        assert len(found) == 200
        assert (found.opacities > 0).any() == (index not in empty)
    for index in empty:
        after, following = moving.at((index + 0.75) / 24), index + 1
        if following < 5 and following not in empty:
            np.testing.assert_allclose(after.means, bg.load(paths[following]).means, rtol=1e-6)
            expected = 0.75 * bg.load(paths[following]).opacities
            np.testing.assert_allclose(after.opacities, expected, rtol=1e-5)


def test_rows_that_cannot_be_drawn_keep_their_place(tmp_path):
    paths = write_frames(tmp_path, range(6))
    for index in (1, 4):
        columns = columns_at(index)
        columns["y"][7] = np.nan
        for number in range(4):
            columns[f"rot_{number}"][9] = 0
        write_scene(paths[index], columns)
    with pytest.warns(bg.SceneWarning, match=r"frame_001\.ply: 2 of 200 rows were dropped: 1 hold .*y = nan"):
        moving = opened(tmp_path)
    assert moving.has_rows
    found, first = moving.at(1 / 24), bg.load(paths[0])
    assert len(found) == 200
    np.testing.assert_array_equal(np.flatnonzero(found.opacities == 0), [7, 9])
    np.testing.assert_array_equal(found.means[[7, 9]], first.means[[7, 9]])
    between, after = moving.at(1.5 / 24), bg.load(paths[2])
    np.testing.assert_array_equal(between.means[7], after.means[7])
    np.testing.assert_allclose(between.opacities[7], after.opacities[7] / 2, rtol=1e-6)
    moving.at(4 / 24)  # told once, not of each moment


def test_rows_that_cannot_be_drawn_are_dropped_where_none_correspond(tmp_path):
    paths = write_frames(tmp_path, range(4), columns=lambda moment: shuffled(columns_at(moment), int(moment)))
    columns = shuffled(columns_at(1), 1)
    columns["opacity"][:3] = np.nan
    write_scene(paths[1], columns)
    with pytest.warns(bg.SceneWarning, match="3 of 200 rows were dropped"):
        moving = opened(tmp_path)
    assert len(moving.at(1 / 24)) == 197


def test_damaged_and_missing_frames_are_named_when_their_moment_comes(tmp_path, monkeypatch):
    monkeypatch.setattr("brushgs.formats.moving.frames._NUM_HEADERS", 2)
    paths = write_frames(tmp_path, range(9))
    write_scene(paths[2], columns_at(2, 150))
    paths[3].write_bytes(paths[3].read_bytes()[:-100])
    paths[6].write_bytes(b"")
    moving = opened(tmp_path)
    assert moving.has_rows
    fails(r"frame_002\.ply: holds 150 Gaussians and frame_000\.ply 200, ", moving.at, 2 / 24)
    fails(r"frame_003\.ply: is cut off", moving.at, 3 / 24)
    fails(r"frame_006\.ply: is empty", moving.at, 6 / 24)
    assert len(moving.at(8 / 24)) == 200
    paths.pop().unlink()
    gone = tmp_path / "frame_008.ply"
    fails(r"frame_008\.ply: there is no such file; check the path", open_moving, [*paths, gone])
    paths[0].write_bytes(b"<html>")
    fails(r"frame_000\.ply: is a web page", open_moving, tmp_path)
    for path in paths:
        nothing(path)
    fails(r"frame_000\.ply: and all moments after it hold no Gaussians", open_moving, tmp_path)
    fails(r"no_\*\.ply: there is no such file", load_moving, tmp_path / "no_*.ply")


# What files say beside their Gaussians


def strokes(folder, count):
    """Of `count` moments; from the third on, brushes have another order."""
    folder.mkdir()
    scene = replace(still_life_of(1000), brushes=np.arange(len(still_life_of(1000)), dtype=np.uint8) % 2)
    for index in range(count):
        moved = replace(scene, means=scene.means + np.float32(0.01 * index))
        brushes = ("flat", "dab") if index < 2 else ("dab", "flat")
        path = folder / f"frame_{index}.ply"
        save_scene(moved, path, is_strokes=True, scene="koala", brushes=brushes)


def test_a_clip_of_strokes_keeps_its_brushes_unless_they_are_of_another_set(tmp_path):
    strokes(tmp_path / "s", 2)
    moving = opened(tmp_path / "s")
    assert moving.notes.is_strokes
    assert (moving.notes.brushes, moving.notes.scene) == (("flat", "dab"), "koala")
    for time in (0, 0.01, 1):
        found = moving.at(time)
        np.testing.assert_array_equal(found.brushes, np.arange(len(found)) % 2)
    gaussians, notes = read_scene(SceneSource((tmp_path / "s",), time=bg.Moment(0.5, is_share=True)))
    assert notes.is_strokes
    assert notes.brushes == ("flat", "dab")
    assert gaussians.brushes is not None
    strokes(tmp_path / "t", 3)
    words = r"frame_2\.ply: the brushes .* those of frame_0\.ply are others"
    with pytest.warns(bg.SceneWarning, match=words):
        moving = opened(tmp_path / "t")
    assert moving.at(1).brushes is None


# One moment, as a scene


def test_a_moment_is_read_as_its_file_is_and_between_files_it_is_made_of_both(tmp_path):
    paths = write_frames(tmp_path, range(5))
    times = {None: 0, bg.Moment(2 / 24): 2, bg.Moment(0.083): 2, bg.Moment(1.0, is_share=True): 4}
    for time, index in times.items():
        words = ("0.00", "", "0.08", "", "0.17")[index]
        gaussians, notes = read_scene(SceneSource((tmp_path,), time=time))
        assert_same(gaussians, bg.load(paths[index]))
        assert notes.format == f"PLY, binary little-endian, moment {words} s of 0.21 s"
    gaussians, notes = read_scene(SceneSource((tmp_path,), time=bg.Moment(0.05)))
    assert_same(gaussians, opened(tmp_path).at(0.05))
    assert notes.format == "5 moments at 24 a second, PLY, binary little-endian, moment 0.05 s of 0.21 s"


def test_moments_that_are_not_there_are_refused(tmp_path):
    def load(path, *time, **kind):
        return bg.load(SceneSource((path,), time=bg.Moment(*time, **kind)))

    paths = write_frames(tmp_path, range(4))
    fails(r"is a scene at rest, which has no moments; omit the time", load, paths[0], 0.4)
    assert len(load(paths[0], 0, is_all=True)) == 200
    fails(r"lasts 0\.1667 s, and 2 s is after its end; choose another moment", load, tmp_path, 2)
    nothing(paths[3])
    fails(r"frame_003\.ply: holds no Gaussians; choose another moment", load, tmp_path, 1.0, True)
