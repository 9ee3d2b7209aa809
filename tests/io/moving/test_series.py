"""Which names are numbered like the moments of a moving scene."""

from pathlib import Path

import pytest

import brushgs as bg
from brushgs.formats.moving.frames import find_series
from tests.kit.for_each import for_each


def series(*names: str):
    return find_series([Path(name) for name in names])


@for_each(
    ("names", "kind"),
    [
        (["frame_000.ply", "frame_001.ply"], "moments"),
        (["dance_frame7.compressed.ply", "dance_frame8.compressed.ply"], "moments"),
        (["time_00000.ply", "time_00001.ply"], "moments"),
        (["Timestep-1.spz", "Timestep-2.spz"], "moments"),
        (["00010.ply", "00011.ply"], "unsure"),
        (["f1.ply", "f2.ply"], "unsure"),
        (["dance_1.ply", "dance_2.ply"], "unsure"),
        (["tile_0.ply", "tile_1.ply"], "others"),
        (["chunk0.ply", "chunk1.ply"], "others"),
        (["scan_lod0.ply", "scan_lod1.ply"], "others"),
        (["iteration_7000.ply", "iteration_30000.ply"], "others"),
        (["a/frame_1/point_cloud.ply", "a/frame_2/point_cloud.ply"], "moments"),
        (["a/1/b/point_cloud.ply", "a/2/b/point_cloud.ply"], "unsure"),
    ],
)
def test_the_word_before_the_number_says_what_files_are(names, kind):
    found = series(*names)
    assert (found.kind, found.is_regular) == (kind, True)
    assert [str(path) for path in found.paths] == names


@for_each(
    "names",
    [
        [],
        ["frame_0.ply"],
        ["frame_0.ply", "frame_1.ply", "ground.ply"],
        ["a_frame_0.ply", "b_frame_1.ply"],
        ["left.ply", "right.ply"],
        ["scan1.ply", "scan01.ply"],  # the same number, and no word for moments
        ["1" * 20 + ".ply", "2" * 20 + ".ply"],
    ],
)
def test_other_names_are_no_series(names):
    assert series(*names) is None


def test_files_are_in_order_of_their_numbers_however_they_are_named_or_listed():
    numbers = ["frame_10.ply", "frame_9.spz", "frame_011.ply"]
    for names in (numbers, ["time_0.5.ply", "time_0.25.ply", "time_1.0.ply"]):
        found = series(*names)
        assert [path.name for path in found.paths] == [names[place] for place in (1, 0, 2)]
        assert found.slots.tolist() == [0, 1, 2]


@for_each(
    ("numbers", "slots", "is_regular"),
    [
        ([5, 6, 7], [0, 1, 2], True),
        ([0, 10, 20], [0, 1, 2], True),
        ([0, 1, 2, 5], [0, 1, 2, 5], False),
        ([0, 1, 5], [0, 1, 5], False),  # half of six are there
        ([0, 1, 6], [0, 1, 2], False),  # fewer are: numbers do not count moments
        ([1699999999, 1700000133, 1700000140], [0, 1, 2], False),
    ],
)
def test_missing_numbers_keep_their_places(numbers, slots, is_regular):
    found = series(*(f"frame_{number}.ply" for number in numbers))
    assert (found.slots.tolist(), found.is_regular) == (slots, is_regular)
    assert found.num_missing == slots[-1] + 1 - len(slots)


def test_a_moment_that_is_there_twice_is_refused():
    with pytest.raises(bg.SceneError, match=r"frame_0\.\w+: bears the same .*name one kind, by .*c/\*\."):
        series("c/frame_0.ply", "c/frame_0.spz", "c/frame_1.ply", "c/frame_1.spz")
    with pytest.raises(bg.SceneError, match=r"bears the same number as frame_0\.ply.*; name one folder"):
        series("left/frame_0.ply", "left/frame_1.ply", "right/frame_0.ply", "right/frame_1.ply")
