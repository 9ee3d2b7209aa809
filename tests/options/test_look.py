"""Looks: the files that come with the program, what is refused in others, and that one is read as written."""

import json
import os
import re
from dataclasses import replace
from math import radians
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from brushgs.errors import SceneError
from brushgs.options.choices import LOOKS
from brushgs.options.look import MAX_BASES, MAX_BYTES, Look
from brushgs.options.media import Charcoal, Ink, Paint, Watercolour
from brushgs.options.painting import STEPS, PaintConfig
from brushgs.options.stroke_target import UsualCount
from brushgs.options.table import rows_of
from tests.kit.for_each import for_each


def written(folder, text, name="mine.toml"):
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def test_a_look_changes_what_it_names_and_keeps_the_rest_of_its_base(tmp_path):
    path = written(tmp_path, 'base = "oil"\n[light]\nlamp = [90, 30]\n[color]\nchroma = 1.5\n')
    oil, mine = Look.open("oil").config, Look.open(path).config
    assert mine.light.lamp == (radians(90), radians(30))
    assert (mine.light.relief, mine.light.canvas) == (oil.light.relief, oil.light.canvas)
    assert mine.color == replace(oil.color, chroma=1.5)
    assert (mine.cluster, mine.brushes, mine.ground) == (oil.cluster, oil.brushes, oil.ground)
    assert Look.open(path).title == "mine"


def test_a_look_may_start_from_a_file_beside_it(folder):
    (folder / "looks").mkdir()
    written(folder / "looks", "[cluster]\nstrokes = 70\n", "first.toml")
    path = written(folder / "looks", 'base = "first.toml"\n[color]\ngray = true\n')
    config = Look.open(path).config
    assert (config.cluster.strokes, config.color.gray) == (UsualCount(70), True)
    for text, is_stage in (
        ("backdrop = 900", False),  # the number alone is that of loose strokes
        ("backdrop = 900\nstage = true", True),
        ('ground = "paper"', True),
    ):
        mine = written(folder, f'base = "oil"\n[ground]\n{text}\n')
        assert Look.open(mine).config.ground.stage is is_stage


def test_files_of_a_look_lie_beside_it_and_built_in_names_stay(tmp_path):
    for name in ("brush.png", "linen.jpg"):
        (tmp_path / name).touch()
    text = '[brushes]\nother = ["flat", "brush.png", "far.png"]\n[ground]\nground = "linen.jpg"\n'
    config = Look.open(written(tmp_path, text)).config
    assert config.brushes.other == ("flat", str(tmp_path / "brush.png"), "far.png")
    assert config.ground.ground == str(tmp_path / "linen.jpg")


@for_each(
    ("text", "strokes"), [("6000", UsualCount(6000)), ("0.25", 0.25), ('"auto"', "auto"), ('"all"', None)]
)
def test_strokes_are_a_count_a_share_auto_or_all(tmp_path, text, strokes):
    config = Look.open(written(tmp_path, f"[cluster]\nstrokes = {text}\n")).config
    assert config.cluster.strokes == strokes
    assert config.cluster.keeps_strokes == (text in ("6000", '"auto"'))


REFUSED = [
    ("[ground]\nbackdorp = 3\n", "[ground] has no 'backdorp'; did you mean 'backdrop'?"),
    ("[grund]\nground = 'paper'\n", "a look has no [grund]; its tables are"),
    ("= 3", "is not TOML: Invalid statement (at line 1, column 1)"),
    ("[view]\nzoom = 2\n", "[view] belongs to one picture, not to a look"),
    ("titel = 'a'\n", "there is no 'titel' above the tables, only title, good_for, base; did you mean 'titl"),
    ("gloss = 0.1\n", "'gloss' stands above all tables; write it below [light]"),
    ("title = 3\n", "title must be text in quotes, got 3"),
    ("base = 'oli'\n", "base oli: neither a file nor a look, which are oil, impressionist"),
    ("base = 'mine.toml'\n", "base must not be 'mine.toml', which starts from this file"),
    ("[light]\nlamp = [9e9, 50]\n", "[light] lamp must have an azimuth of -720 to 720 degrees, got 9e+09"),
    ("[light]\nlamp = [1, 2, 3]\n", "[light] lamp must be a list of 2 numbers"),
    ("[cluster]\nstrokes = 0\n", "[cluster] strokes must be a count of 1 or more, a share such as 0.1"),
    ("[cluster]\nstrokes = 1.5\n", "[cluster] strokes must be a count of 1 or more, a share such as 0.1"),
    ("[strokes]\ndirection = {a = 1}\n", "[strokes] direction must be text in quotes, got {'a': 1}"),
    ("[media]\ncolor = 'black'\n", "[media] color must be #rrggbb, got 'black'"),
    ("[color]\npigments = 2.5\n", "[color] pigments must be a whole number, got 2.5"),
    ("[brushes]\nlong = ['flat']\n", "[brushes] other must name at least one brush"),
    ("[media]\nkind = 'hatching'\nspacing = [5.0, 2.0]\n", "spacing must not be less in the lightest tone"),
    ("[media]\nkind = 'hatching'\nlength = [80.0, 20.0]\n", "length must name the shortest line first"),
    ("[brushes]\nother = ['']\n", "[brushes] brushes must be names of strokes or image files"),
    (f"[brushes]\nother = {[f'a{i}' for i in range(300)]}\n", "brushes must be at most 256, got 300"),
]


@for_each(("text", "sentence"), REFUSED)
def test_what_no_look_has_is_refused_by_name(tmp_path, text, sentence):
    path = written(tmp_path, text)
    with pytest.raises(SceneError, match=re.escape(sentence)) as refused:
        Look.open(path)
    assert str(refused.value).startswith(str(path))
    assert "\n" not in str(refused.value)


HOSTILE = {
    "no UTF-8": (b'title = "\xff\xfe"\n', "must be text in UTF-8, byte 9 is not"),
    "binary": (bytes(range(256)), "must be text in UTF-8"),
    "large": (b"#" * (MAX_BYTES + 1), f"must have at most {MAX_BYTES} bytes"),
    "deep": (b"a = " + b"[" * 8_000 + b"]" * 8_000, "is nested too deeply"),
    "deep keys": (b"[light]\n" + b".".join([b"lamp"] * 3_000) + b" = 1\n", "lamp must be a list of 2"),
    "many digits": (b"[color]\npigments = " + b"9" * 9999, "is not TOML: Exceeds the limit"),
    "large number": (b"[color]\npigments = " + b"9" * 999, "pigments must be a whole number"),
    "zero byte": (b'[ground]\nground = "a\0.png"\n', "is not TOML"),
    "escapes": (b'[ground]\n"\\u001b[31m" = 1\n', "[ground] has no '\\x1b[31m'"),
}


@for_each(("content", "sentence"), HOSTILE.values())
def test_hostile_files_get_one_sentence(tmp_path, content, sentence):
    path = written(tmp_path, content)
    with pytest.raises(SceneError, match=re.escape(sentence)) as refused:
        Look.open(path)
    assert str(refused.value).isprintable()
    assert len(str(refused.value)) < 1500


def test_what_is_no_file_is_refused(tmp_path):
    with pytest.raises(SceneError, match=r"is a folder, not a look; name a \.toml file in it"):
        Look.open(tmp_path)
    with pytest.raises(SceneError, match=r"watercolor: neither a file.*; did you mean 'watercolour'\?"):
        Look.open("watercolor")
    os.mkfifo(tmp_path / "fifo.toml")
    with pytest.raises(SceneError, match="neither a file nor a look"):
        Look.open(tmp_path / "fifo.toml")


def test_a_long_row_of_bases_is_refused(tmp_path):
    for number in range(MAX_BASES + 3):
        written(tmp_path, f'base = "{number + 1}.toml"\n', f"{number}.toml")
    written(tmp_path, "", f"{MAX_BASES + 3}.toml")
    with pytest.raises(SceneError, match=f"base must not have more than {MAX_BASES} others before it"):
        Look.open(tmp_path / "0.toml")


@st.composite
def parts(draw):
    """A step and some of its fields with values in range."""
    step = draw(st.sampled_from(["color", "ground", "light"]))
    values = {}
    for row in rows_of(STEPS[step]):
        least, most = row.option.ge, row.option.le
        if least is None or most is None or not draw(st.booleans()):
            continue
        if isinstance(row.default, int):
            values[row.field] = draw(st.integers(2, int(most)))
        elif isinstance(row.default, tuple):
            values[row.field] = draw(st.tuples(*[st.floats(least, most)] * 2))
        else:
            values[row.field] = draw(st.floats(least, most))
    return step, values


@given(parts())
def test_what_is_written_is_read_back(tmp_path_factory, part):
    step, values = part
    text = "".join(f"{name} = {json.dumps(value)}\n" for name, value in values.items())
    path = written(tmp_path_factory.mktemp("looks"), f"[{step}]\n{text}")
    assert Look.open(path).config == PaintConfig(**{step: STEPS[step](**values)})


def test_a_medium_is_one_class_and_takes_what_another_has_beside(tmp_path):
    ink = Look.open("ink").config.media
    assert isinstance(ink, Ink)
    assert isinstance(Look.open("charcoal").config.media, Charcoal)
    assert isinstance(Look.open("watercolour").config.media, Watercolour)
    assert Look.open("oil").config.media == Paint()
    path = written(tmp_path, 'base = "ink"\n[media]\nkind = "charcoal"\nchalk = 0.5\n')
    changed = Look.open(path).config.media
    assert isinstance(changed, Charcoal)
    assert (changed.lines, changed.chalk, changed.color) == (ink.lines, 0.5, ink.color)
    assert Look.open(written(tmp_path, "[media]\nwash = 0.3\nchalk = 0.2\n")).config.media == Paint()
    with pytest.raises(SceneError, match=r"\[media\] wash must be 0 to 1, got 3"):
        Look.open(written(tmp_path, "[media]\nwash = 3\n"))


@for_each("page", ["README.md", "docs/looks.md"])
def test_the_documentation_names_every_look(page):
    text = (Path(__file__).resolve().parents[2] / page).read_text(encoding="utf-8")
    listed = text.split("brushgs render scene.spz --look charcoal", 1)[1].split("brushgs render", 1)[0]
    assert [name for name in LOOKS if not re.search(rf"\b{name}\b", "charcoal" + listed)] == []
