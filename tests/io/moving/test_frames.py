"""Moving scenes in a file a moment."""

import pickle
import warnings
import weakref
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats import read_scene
from brushgs.formats.moving import load_moving, open_moving
from brushgs.formats.moving.frames import Frames
from brushgs.formats.moving.kept import have_same_rows
from brushgs.formats.scenes.write import write_scene as save_scene
from brushgs.options.moment import Moment
from brushgs.options.scene_source import SceneSource
from tests.io.moving.frame_maker import columns_at, shuffled, write_frames
from tests.io.ply_maker import decoded, scene_columns, write_scene
from tests.scenes import still_life_of


@pytest.fixture(autouse=True)
def no_warnings():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def assert_equal(actual: bg.Gaussians, expected: bg.Gaussians) -> None:
    for name, column in expected.columns().items():
        np.testing.assert_array_equal(getattr(actual, name), column, err_msg=name)


def opened(scene) -> bg.MovingScene:
    moving = open_moving(scene)
    assert moving is not None
    return moving


# Files become moments


@pytest.mark.parametrize("name", ["frame_{:03}.ply", "time_{:05}.ply", "dance_{}.ply", "{:04}.ply"])
@pytest.mark.filterwarnings("ignore:.*lie in one place")
def test_a_folder_of_numbered_files_is_a_clip(tmp_path: Path, name: str) -> None:
    paths = write_frames(tmp_path / "clip", range(12), name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", bg.SceneWarning)
        moving = opened(tmp_path / "clip")
    assert (moving.duration, moving.has_rows, moving.resting) == (12 / 24, True, None)
    assert moving.times is not None
    np.testing.assert_allclose(moving.times, np.arange(12) / 24)
    for index in (0, 3, 11):
        assert_equal(moving.at(index / 24), bg.load(paths[index]))
    assert moving.notes is not None
    assert moving.notes.format == "12 moments at 24 a second, PLY, binary little-endian"


def test_a_pattern_without_a_match_is_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(bg.SceneError, match=r"no_\*\.ply: there is no such file"):
        load_moving(tmp_path / "no_*.ply")


def test_the_formats_of_frames_may_be_any(tmp_path: Path) -> None:
    paths = [tmp_path / "frame_0.ply", tmp_path / "frame_1.splat"]
    write_scene(paths[0], columns_at(0))
    rows = np.zeros(200, [("a", "<f4", 6), ("b", "u1", 8)])
    rng = np.random.default_rng(0)
    rows["a"], rows["b"] = rng.random((200, 6)), rng.integers(1, 255, (200, 8))
    paths[1].write_bytes(rows.tobytes())
    moving = opened(tmp_path)
    assert not moving.has_rows
    assert len(moving.at(1)) == 200


# A clip, or one scene in parts


def tiles(folder: Path, name: str, count: int = 4, *, apart: float, num_rows: int = 300) -> Path:
    for index in range(count):
        columns = scene_columns(num_rows, seed=index)
        columns["x"] = (columns["x"] + apart * index).astype(np.float32)
        folder.mkdir(exist_ok=True)
        write_scene(folder / name.format(index), columns)
    return folder


@pytest.mark.parametrize(
    ("name", "apart", "is_clip"),
    [
        ("frame_{}.ply", 100, True),
        ("tile_{}.ply", 0, False),
        ("chunk_{}.ply", 0, False),
        ("lod{}.ply", 0, False),
        ("scan_{}.ply", 0, True),
        ("scan_{}.ply", 0.5, True),
        ("scan_{}.ply", 4, False),
        ("{}.ply", 0, True),
        ("{}.ply", 100, False),
    ],
)
def test_names_decide_and_then_places(tmp_path: Path, name: str, apart: float, is_clip: bool) -> None:
    folder = tiles(tmp_path / "a", name, apart=apart)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert (open_moving(folder) is not None) is is_clip
    is_told = is_clip and "frame" not in name
    assert [("lie in one place" in str(w.message), "--time all" in str(w.message)) for w in caught] == [
        (True, True)
    ] * is_told


def test_files_of_very_different_counts_are_no_moments_by_their_place(tmp_path: Path) -> None:
    for index, count in enumerate((800, 400, 200)):  # levels of detail
        write_scene(tmp_path / f"scan_{index}.ply", scene_columns(count))
    assert open_moving(tmp_path) is None


def test_two_files_without_a_word_for_moments_are_parts(tmp_path: Path) -> None:
    paths = write_frames(tmp_path, range(2), "left_{}.ply")
    assert open_moving(paths) is None
    assert len(bg.load(paths)) == 400


# Do rows correspond?


def still(count: int = 3000) -> bg.Gaussians:
    return still_life_of(count)


def sorted_in_space(scene: bg.Gaussians) -> bg.Gaussians:
    """Along x, as some writers sort."""
    return scene.take(np.argsort(scene.means[:, 0], kind="stable"))


def without(scene: bg.Gaussians, share: float, seed: int) -> bg.Gaussians:
    rows = np.random.default_rng(seed).permutation(len(scene))[round(share * len(scene)) :]
    return scene.take(np.sort(rows))


def test_rows_in_any_other_order_do_not_correspond() -> None:
    scene = still()
    rng = np.random.default_rng(0)
    order = rng.permutation(len(scene))
    assert have_same_rows(scene, scene)
    assert not have_same_rows(scene, scene.take(order))
    assert not have_same_rows(scene, scene.take(slice(None, None, -1)))
    assert not have_same_rows(scene, scene.take(slice(1, None)))
    assert not have_same_rows(sorted_in_space(scene), sorted_in_space(scene.take(slice(0, -1))))
    lost = [without(scene, 0.03, seed) for seed in (1, 2)]
    assert not have_same_rows(*lost)
    assert not have_same_rows(*(sorted_in_space(some) for some in lost))
    halves = sorted_in_space(scene).take(slice(0, None, 2)), sorted_in_space(scene).take(slice(1, None, 2))
    assert not have_same_rows(*halves)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_few_rows_correspond_if_they_are_alike(count: int) -> None:
    some = still().take(slice(0, count))
    assert have_same_rows(some, some)


# Between two moments


def test_between_moments_rows_lie_on_a_line_and_turn_the_shorter_way(tmp_path: Path) -> None:
    paths = write_frames(tmp_path, range(3))
    flipped = columns_at(1)
    for index in range(4):
        flipped[f"rot_{index}"] *= -1  # the same rotation
    write_scene(paths[1], flipped)
    moving = opened(tmp_path)
    one, other = (decoded(columns_at(moment)) for moment in (0, 1))
    found = moving.at(0.25 / 24)
    for name in ("means", "scales", "opacities", "sh"):
        np.testing.assert_allclose(
            getattr(found, name), 0.75 * one[name] + 0.25 * other[name], rtol=1e-5, atol=1e-6, err_msg=name
        )
    turn = decoded(columns_at(0.25))["quats"]
    cosines = np.abs(np.sum(found.quats * turn, axis=1))
    np.testing.assert_allclose(
        cosines, np.linalg.norm(turn, axis=1) * np.linalg.norm(found.quats, axis=1), rtol=1e-6
    )


def test_times_before_and_after_are_the_first_and_the_last(tmp_path: Path) -> None:
    paths = write_frames(tmp_path, range(3))
    moving = opened(tmp_path)
    assert_equal(moving.at(-1), bg.load(paths[0]))
    assert_equal(moving.at(9), bg.load(paths[2]))
    with pytest.raises(ValueError, match="time must be a number"):
        moving.at(float("nan"))


def test_the_moments_of_a_scene_cross_processes(tmp_path: Path) -> None:
    write_frames(tmp_path, range(4))
    moving = opened(tmp_path)
    other = pickle.loads(pickle.dumps(moving))
    assert_equal(other.at(0.05), moving.at(0.05))


# Memory


def test_a_clip_that_is_read_through_never_has_more_than_three_moments_in_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_frames(tmp_path, range(200), columns=lambda moment: columns_at(moment, 50))
    living: weakref.WeakSet[bg.Gaussians] = weakref.WeakSet()
    most = 0
    read = Frames._read

    def counted(self: Frames, index: int):
        nonlocal most
        kept = read(self, index)
        living.add(kept.gaussians)
        most = max(most, len(living))
        return kept

    monkeypatch.setattr(Frames, "_read", counted)
    moving = opened(tmp_path)
    for time in np.arange(0, 199.5, 0.5) / 24:
        found = moving.at(time)
        most = max(most, len({found, *living}))
    assert most <= 3
    assert len(living) <= 2


# Stiff cases


def test_a_clip_of_many_names_is_hardly_opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its files are links to one that is there, or that was never copied."""
    (frame,) = write_frames(tmp_path / "there", [0])
    folder = tmp_path / "clip"
    folder.mkdir()
    for number in range(10_000):
        there = number % 100 or number == 0
        (folder / f"frame_{10 * number:06}.ply").symlink_to(frame if there else tmp_path / "gone.ply")
    opened_paths = []
    open_path = Path.open

    def counted(self: Path, *args, **options):
        opened_paths.append(self)
        return open_path(self, *args, **options)

    monkeypatch.setattr(Path, "open", counted)
    with pytest.warns(bg.SceneWarning, match=r"clip: 99 of 10,000 moments are missing by their numbers"):
        moving = opened(folder)
    assert moving.duration == 10_000 / 24
    assert len(moving.at(100 / 24)) == 200
    assert len(opened_paths) < 200


def test_a_file_that_is_named_must_be_there(tmp_path: Path) -> None:
    paths = write_frames(tmp_path, range(4))
    paths[2].unlink()
    with pytest.raises(bg.SceneError, match=r"frame_002\.ply: there is no such file; check the path"):
        open_moving(paths)


def test_frames_of_different_counts_have_no_rows(tmp_path: Path) -> None:
    write_frames(tmp_path, range(6), columns=lambda moment: columns_at(moment, 100 + int(moment)))
    moving = opened(tmp_path)
    assert not moving.has_rows
    assert [len(moving.at(moment / 24)) for moment in range(6)] == [100, 101, 102, 103, 104, 105]


def test_a_count_that_changes_unseen_is_refused_when_its_moment_comes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("brushgs.formats.moving.frames._NUM_HEADERS", 2)
    paths = write_frames(tmp_path, range(9))
    write_scene(paths[2], columns_at(2, 150))
    moving = opened(tmp_path)
    assert moving.has_rows
    with pytest.raises(bg.SceneError, match=r"frame_002\.ply: holds 150 Gaussians and frame_000\.ply 200, "):
        moving.at(2 / 24)


def nothing(path: Path) -> Path:
    return write_scene(path, {name: values[:0] for name, values in scene_columns(1).items()})


@pytest.mark.parametrize("empty", [(0,), (2,), (0, 1), (2, 3), (4,)])
def test_where_rows_correspond_an_empty_moment_has_all_of_them_unseen(
    tmp_path: Path, empty: tuple[int]
) -> None:
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
        after = moving.at((index + 0.75) / 24)
        if index + 1 < 5 and index + 1 not in empty:
            np.testing.assert_allclose(after.means, bg.load(paths[index + 1]).means, rtol=1e-6)
            np.testing.assert_allclose(after.opacities, 0.75 * bg.load(paths[index + 1]).opacities, rtol=1e-5)


def test_a_clip_of_nothing_is_refused(tmp_path: Path) -> None:
    for index in range(3):
        nothing(tmp_path / f"frame_{index}.ply")
    with pytest.raises(bg.SceneError, match=r"frame_0\.ply: and all moments after it hold no Gaussians"):
        open_moving(tmp_path)


def test_rows_that_cannot_be_drawn_keep_their_place(tmp_path: Path) -> None:
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


def test_rows_that_cannot_be_drawn_are_dropped_where_none_correspond(tmp_path: Path) -> None:
    paths = write_frames(tmp_path, range(4), columns=lambda moment: shuffled(columns_at(moment), int(moment)))
    columns = shuffled(columns_at(1), 1)
    columns["opacity"][:3] = np.nan
    write_scene(paths[1], columns)
    with pytest.warns(bg.SceneWarning, match="3 of 200 rows were dropped"):
        moving = opened(tmp_path)
    assert len(moving.at(1 / 24)) == 197


def test_a_damaged_frame_is_named_when_its_moment_comes(tmp_path: Path) -> None:
    paths = write_frames(tmp_path, range(9))
    paths[3].write_bytes(paths[3].read_bytes()[:-100])
    paths[6].write_bytes(b"")
    moving = opened(tmp_path)
    with pytest.raises(bg.SceneError, match=r"frame_003\.ply: is cut off"):
        moving.at(3 / 24)
    with pytest.raises(bg.SceneError, match=r"frame_006\.ply: is empty"):
        moving.at(6 / 24)
    assert len(moving.at(8 / 24)) == 200


def test_a_clip_whose_first_frame_is_no_scene_is_refused(tmp_path: Path) -> None:
    paths = write_frames(tmp_path, range(3))
    paths[0].write_bytes(b"<html>")
    with pytest.raises(bg.SceneError, match=r"frame_000\.ply: is a web page"):
        open_moving(tmp_path)


# What files say beside their Gaussians


def strokes(folder: Path, count: int = 3, brushes=("flat", "dab")) -> None:
    folder.mkdir()
    scene = still_life_of(1000)
    rows = np.arange(len(scene), dtype=np.uint8) % 2
    for index in range(count):
        moved = bg.Gaussians(
            scene.means + np.float32(0.01 * index),
            scene.quats,
            scene.scales,
            scene.opacities,
            scene.sh,
            brushes=rows,
        )
        save_scene(
            moved,
            folder / f"frame_{index}.ply",
            is_strokes=True,
            scene="koala",
            brushes=brushes if index < 2 else brushes[::-1],
        )


def test_a_clip_of_strokes_keeps_its_brushes(tmp_path: Path) -> None:
    strokes(tmp_path / "s", 2)
    moving = opened(tmp_path / "s")
    assert moving.notes is not None
    assert moving.notes.is_strokes
    assert (moving.notes.brushes, moving.notes.scene) == (("flat", "dab"), "koala")
    for time in (0, 0.01, 1):
        found = moving.at(time)
        assert found.brushes is not None
        np.testing.assert_array_equal(found.brushes, np.arange(len(found)) % 2)
    gaussians, notes = read_scene(SceneSource((tmp_path / "s",), time=Moment(0.5, is_share=True)))
    assert notes.is_strokes
    assert notes.brushes == ("flat", "dab")
    assert gaussians.brushes is not None


def test_brushes_of_another_set_are_dropped_with_a_word(tmp_path: Path) -> None:
    strokes(tmp_path / "s", 3)
    with pytest.warns(
        bg.SceneWarning, match=r"frame_2\.ply: the brushes .* those of frame_0\.ply are others"
    ):
        moving = opened(tmp_path / "s")
    assert moving.at(1).brushes is None


# One moment, as a scene


def test_a_moment_is_read_as_its_file_is(tmp_path: Path) -> None:
    paths = write_frames(tmp_path, range(5))
    for time, path, words in (
        (None, paths[0], "0.00"),
        (Moment(2 / 24), paths[2], "0.08"),
        (Moment(0.083), paths[2], "0.08"),
        (Moment(1.0, is_share=True), paths[4], "0.17"),
    ):
        gaussians, notes = read_scene(SceneSource((tmp_path,), time=time))
        assert_equal(gaussians, bg.load(path))
        assert notes.format == f"PLY, binary little-endian, moment {words} s of 0.21 s"


def test_a_moment_between_files_is_made_of_both(tmp_path: Path) -> None:
    write_frames(tmp_path, range(5))
    gaussians, notes = read_scene(SceneSource((tmp_path,), time=Moment(0.05)))
    assert_equal(gaussians, opened(tmp_path).at(0.05))
    assert notes.format == "5 moments at 24 a second, PLY, binary little-endian, moment 0.05 s of 0.21 s"


def test_a_moment_of_a_scene_at_rest_is_refused(tmp_path: Path) -> None:
    (path,) = write_frames(tmp_path, [0])
    with pytest.raises(bg.SceneError, match=r"is a scene at rest, which has no moments; omit the time"):
        bg.load(SceneSource((path,), time=Moment(0.4)))
    assert len(bg.load(SceneSource((path,), time=Moment(0, is_all=True)))) == 200


def test_a_moment_after_the_end_or_without_gaussians_is_refused(tmp_path: Path) -> None:
    paths = write_frames(tmp_path, range(4))
    with pytest.raises(
        bg.SceneError, match=r"lasts 0\.1667 s, and 2 s is after its end; choose another moment"
    ):
        bg.load(SceneSource((tmp_path,), time=Moment(2)))
    nothing(paths[3])
    with pytest.raises(bg.SceneError, match=r"frame_003\.ply: holds no Gaussians; choose another moment"):
        bg.load(SceneSource((tmp_path,), time=Moment(1, is_share=True)))


def test_the_doctor_examines_a_moment(tmp_path: Path) -> None:
    paths = write_frames(tmp_path, range(3))
    columns = columns_at(1)
    columns["x"][3] = np.inf
    write_scene(paths[1], columns)
    names = [f.name for f in bg.examine(SceneSource((tmp_path,), time=Moment(1 / 24)))]
    alone = [f.name for f in bg.examine(paths[1])]
    assert names == alone
    with pytest.warns(bg.SceneWarning, match="were dropped"):
        bg.examine(SceneSource((tmp_path,), time=Moment(0.05)))
