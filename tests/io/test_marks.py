"""Files of marks: what is written is read again, and wrong files are refused in a sentence."""

import base64
import json

import numpy as np
import pytest

from brushgs.formats.marks import read_marks, write_marks
from brushgs.values.marks import Overpaint
from tests.io.marks_maker import example
from tests.io.test_images import png
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse_bytes


def columns(found: Overpaint) -> dict[str, np.ndarray]:
    parts = {name: part for name, part in vars(found).items() if name != "time" and part is not None}
    return {f"{name}.{key}": getattr(part, key) for name, part in parts.items() for key in part.COLUMNS}


def test_what_is_written_is_read_again(tmp_path):
    write_marks(example(), tmp_path / "a.marks")
    found = read_marks(tmp_path / "a.marks")
    assert found.time == 0.5
    for name, array in columns(example()).items():
        np.testing.assert_array_equal(columns(found)[name], array, err_msg=name)
    for ours, theirs in zip(found.marks.images, example().marks.images, strict=True):
        np.testing.assert_array_equal(ours[..., 3], theirs[..., 3])
        np.testing.assert_array_equal(ours[ours[..., 3] > 0], theirs[theirs[..., 3] > 0])
    write_marks(found, tmp_path / "b.marks")
    assert (tmp_path / "a.marks").read_bytes() == (tmp_path / "b.marks").read_bytes()


def test_marks_of_several_files_add_up():
    joined = Overpaint.joined([example(), Overpaint(), example()])
    assert [len(one) for one in (joined.marks, joined.erased, joined.combs, joined.density)] == [4] * 4
    for row in range(4):
        image = joined.marks.images[joined.marks.tiles[row]]
        np.testing.assert_array_equal(image, example().marks.images[row % 2])


HUGE = base64.b64encode(png(1 << 15, 1 << 15, 8, 6, b"\0" * 99)).decode()


@for_each(
    "part, field, value, sentence",
    [
        (None, "brushgs", "style", "marks"),
        (None, "version", 2, "version"),
        ("marks", "lengths", [1.0], r"marks\.lengths"),
        ("marks", "widths", [1.0, 0.0], r"marks\.widths"),
        ("erased", "normals", [[0, 0, 2], [0, 0, 1]], r"erased\.normals"),
        ("marks", "normals", [[1, 0, 0]] * 2, "perpendicular"),
        ("atlas", "places", [[0, 0, 4, 5], [4000, 1, 6, 3]], "atlas"),
        ("marks", "tiles", [0, 7], "tiles"),
        ("density", "factors", [1.0, 1e9], r"density\.factors"),
        ("atlas", "picture", {"type": "png", "data": "AAAA"}, "atlas"),
        ("atlas", "picture", {"type": "png", "data": HUGE}, "atlas"),
        ("marks", "color", [1.0], "color"),
    ],
)
def test_wrong_files_are_refused(part, field, value, sentence, tmp_path):
    path = tmp_path / "a.marks"
    write_marks(example(), path)
    content = json.loads(path.read_text())
    (content[part] if part else content)[field] = value
    refuse_bytes(path, json.dumps(content).encode(), sentence, read_marks)


def test_marks_go_to_files_of_their_own_suffix(tmp_path):
    with pytest.raises(ValueError, match=r"marks"):
        write_marks(example(), tmp_path / "a.json")
    assert list(tmp_path.iterdir()) == []
