"""Files of marks: what is written is read again, and hostile ones are refused in a sentence."""

import json
from pathlib import Path

import numpy as np
import pytest

from brushgs.errors import SceneError
from brushgs.formats.marks import read_marks, write_marks
from brushgs.values.marks import Erased, Marks, Overpaint


def example() -> Overpaint:
    rng = np.random.default_rng(5)
    images = tuple(rng.integers(0, 256, (5 + row, 9 + row, 4), np.uint8) for row in range(3))
    along, facing = np.tile([1.0, 0, 0], (4, 1)), np.tile([0, 0, 1.0], (4, 1))
    ones, tiles = np.ones(4), np.array([0, 1, 2, -1])
    marks = Marks(rng.random((4, 3)), along, facing, ones, ones, rng.random((4, 3)), ones, tiles, images)
    return Overpaint(marks, Erased(np.zeros((1, 3)), [[0, 0, 1]], [0.5]), time=0.5)


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    one = example()
    write_marks(Overpaint.joined([one, one]), tmp_path / "a.marks")
    found = read_marks(tmp_path / "a.marks")
    assert found.marks is not None
    assert one.marks is not None
    assert found.time == 0.5
    assert found.marks.tiles.tolist() == [0, 1, 2, -1, 3, 4, 5, -1]
    for image, wanted in zip(found.marks.images, one.marks.images * 2, strict=True):
        np.testing.assert_array_equal(image, wanted)
    np.testing.assert_allclose(found.marks.means[:4], one.marks.means, atol=1e-6)


@pytest.mark.parametrize(
    ("place", "value"),
    [
        ("marks.tiles", [0, 1, 2, 9]),
        ("marks.lengths", [1, 1, 1, -1]),
        ("marks.normals", [[1, 0, 0]] * 4),
        ("erased.radii", [0.5, 0.5]),
        ("atlas.places", [[0, 0, 900, 900]]),
    ],
)
def test_a_wrong_field_is_named(tmp_path: Path, place: str, value: object) -> None:
    path = tmp_path / "a.marks"
    write_marks(example(), path)
    content = json.loads(path.read_text())
    part, field = place.split(".")
    content[part][field] = value
    path.write_text(json.dumps(content))
    with pytest.raises(SceneError, match=f"{part}.{field}"):
        read_marks(path)
