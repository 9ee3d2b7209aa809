"""The name and the first view of a scene in the header of a file of strokes."""

import base64
import json
from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from brushgs.errors import SceneWarning
from brushgs.formats import read_scene
from brushgs.formats.scenes.ply_header import PREFIX, comment_lines
from brushgs.formats.scenes.stored import Stored, parse_text
from brushgs.formats.scenes.write import write_scene
from brushgs.values.camera import Camera, FirstView, Photograph
from tests.io.test_write_ply import make
from tests.kit.for_each import for_each

POINTS, WHOLE = np.array([[0.1, -2e30, 1 / 3], [-0.0, 5e-324, 7]]), np.array([[-1.5, 0, 0], [1, 2, 1 / 3]])
LENS = Camera(np.eye(4), np.array([[80.5, 0, 1 / 3], [0, 81, 32], [0, 0, 1]]), 96, 64)
EVERY_FIELD = FirstView(POINTS, np.array([0.6, -0.8, 0.0]), 1 / 3, -0.1, eye=np.array([1e-9, 2.0, -3.0]))
EVERY_FIELD = replace(EVERY_FIELD, has_surroundings=True, probability=0.4071, front=-2.5, is_front_sure=False)
EVERY_FIELD = replace(EVERY_FIELD, ups=(("-y", 0.4071), ("+z", 1 / 7)), whole=WHOLE)
EVERY_FIELD = replace(EVERY_FIELD, photograph=Photograph(LENS, np.ones(3) / 3, 0.1))
FEWEST_FIELDS = FirstView(np.ones((1, 3)), np.array([0.0, 0, 1]), 0.0, 0.0)


def text_of(lines):
    assert all(line.startswith(PREFIX) for line in lines)
    return "".join(line.removeprefix(PREFIX) for line in lines)


def assert_same(one, other):
    for field in fields(one):
        a, b = getattr(one, field.name), getattr(other, field.name)
        assert type(a) is type(b), field.name
        if is_dataclass(a):
            assert_same(a, b)
            continue
        assert (a.tobytes(), a.shape) == (b.tobytes(), b.shape) if isinstance(a, np.ndarray) else a == b


@for_each("view", [EVERY_FIELD, FEWEST_FIELDS])
@for_each("name", ["koala", "Käfer \N{KOALA}", 'a "b" \\c', None])
def test_what_is_written_reads_back_to_the_last_bit(tmp_path, view, name):
    write_scene(make(100), tmp_path / "a.ply", is_strokes=True, scene=name, first_view=view)
    _, notes = read_scene(tmp_path / "a.ply")
    assert notes.scene == name
    assert notes.is_strokes
    assert_same(notes.first_view, view)


def damaged(**changed):
    content = json.loads(text_of(comment_lines(Stored("a", EVERY_FIELD))))
    content["first_view"] |= changed
    return json.dumps(content)


@for_each(
    "text",
    [
        '{"scene":"a\\u0000"}',
        '{"order":"AAAA"}',
        damaged(up=[0, 0, 2]),
        damaged(eye=[0, 0, 1e39]),
        damaged(points=""),
        damaged(whole=base64.b64encode(np.ones((3, 3))).decode()),
    ],
)
def test_a_damaged_comment_is_told_and_not_used(tmp_path, text):
    with pytest.raises(ValueError):
        parse_text(text)
    write_scene(make(100), tmp_path / "a.ply", is_strokes=True)
    before, after = (tmp_path / "a.ply").read_bytes().split(b"element", 1)
    comments = "".join(f"{PREFIX}{text[i : i + 150]}\n" for i in range(0, len(text), 150))
    (tmp_path / "a.ply").write_bytes(before + comments.encode() + b"element" + after)
    with pytest.warns(SceneWarning, match="the notes on its strokes .* cannot be read .* as any scene"):
        _, notes = read_scene(tmp_path / "a.ply")
    assert (notes.scene, notes.first_view, notes.is_strokes) == (None, None, True)


@settings(max_examples=200, deadline=None)
@given(data=st.data())
def test_no_change_of_a_byte_is_more_than_a_value_error(data):
    text = bytearray(text_of(comment_lines(Stored("koala", EVERY_FIELD))).encode())
    for _ in range(data.draw(st.integers(1, 4))):
        text[data.draw(st.integers(0, len(text) - 1))] = data.draw(st.integers(32, 126))
    try:
        view = parse_text(text.decode()).first_view
    except ValueError:
        return
    if view is not None:
        assert np.isfinite(view.points).all()
        assert np.linalg.norm(view.up) == pytest.approx(1)
