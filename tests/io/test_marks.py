"""Files of marks: what is written is read again, and wrong files are refused in a sentence."""

import base64
import json

import numpy as np
import pytest

from brushgs.errors import SceneError
from brushgs.formats.marks import read_marks, write_marks
from brushgs.values.marks import Overpaint
from tests.io.marks_maker import example
from tests.kit.for_each import for_each


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


def changed(field: str, value: object):
    def change(content: dict) -> None:
        *path, last = field.split(".")
        for step in path:
            content = content[step]
        content[last] = value

    return change


WRONG = {
    "no marks": (changed("brushgs", "style"), "marks"),
    "a later version": (changed("version", 2), "version"),
    "a wrong count": (changed("marks.lengths", [1.0]), r"marks\.lengths"),
    "no width": (changed("marks.widths", [1.0, 0.0]), r"marks\.widths"),
    "a long normal": (changed("erased.normals", [[0, 0, 2], [0, 0, 1]]), r"erased\.normals"),
    "no right angle": (changed("marks.normals", [[1, 0, 0]] * 2), "perpendicular"),
    "a tile outside": (changed("atlas.places", [[0, 0, 4, 5], [4000, 1, 6, 3]]), "atlas"),
    "a tile that is not there": (changed("marks.tiles", [0, 7]), "tiles"),
    "a factor": (changed("density.factors", [1.0, 1e9]), r"density\.factors"),
    "no picture": (changed("atlas.picture", {"type": "png", "data": "AAAA"}), "atlas"),
    "an unknown field": (changed("marks.colour", [1.0]), "colour"),
}


@for_each("name", WRONG)
def test_wrong_files_are_refused(name, tmp_path):
    change, sentence = WRONG[name]
    path = tmp_path / "a.marks"
    write_marks(example(), path)
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))
    with pytest.raises(SceneError, match=sentence):
        read_marks(path)


def test_a_huge_atlas_is_refused_by_its_header(tmp_path):
    path = tmp_path / "a.marks"
    write_marks(example(), path)
    content = json.loads(path.read_text())
    png = bytearray(base64.b64decode(content["atlas"]["picture"]["data"]))
    png[16:24] = (1 << 15).to_bytes(4, "big") * 2
    content["atlas"]["picture"]["data"] = base64.b64encode(bytes(png)).decode()
    path.write_text(json.dumps(content))
    with pytest.raises(SceneError, match="atlas"):
        read_marks(path)


def test_a_file_keeps_its_content_if_another_cannot_be_written(tmp_path):
    path = tmp_path / "a.marks"
    write_marks(example(), path)
    before = path.read_bytes()
    with pytest.raises(ValueError, match=r"marks"):
        write_marks(example(), tmp_path / "a.json")
    assert path.read_bytes() == before
    assert [one.name for one in tmp_path.iterdir()] == ["a.marks"]
