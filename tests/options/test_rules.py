"""Rules are read from TOML, and what is wrong in them is said in one sentence."""

import pytest

from brushgs.errors import SceneError
from brushgs.options.direction import Direction
from brushgs.options.rules import MAX_BYTES, MAX_RULES, Rule, Rules
from brushgs.options.where import Where
from tests.kit.for_each import for_each

WHERE = '[[region]]\nwhere = "subject"\n'
ALL = """
camera_file = "cameras.json"
[[region]]
name = "body"
where = "subject and not mask:masks"
brushes = ["dab", "own.png"]
size = 0.7
share = 2
palette = "monet.jpg"
palette_strength = 0.5
style = "a.style:0.25,b.style"
adjust = {saturation = 0.4, swaps = ["#000000:#ffffff"]}
direction = "guides:lines.json"
opacity = 0.9
soft = 0.05
hold = 3
boil = 0.2
redraw = 0.5
[[region]]
where = "surroundings"
"""


def read(tmp_path, text):
    file = tmp_path / "rules.toml"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return Rules.of(file)


def test_every_field_is_read_and_files_lie_beside_the_rules(tmp_path):
    for name in ("cameras.json", "own.png", "monet.jpg", "a.style", "lines.json"):
        (tmp_path / name).touch()
    (tmp_path / "masks").mkdir()
    with pytest.raises(SceneError, match="add up to at most 1"):
        read(tmp_path, ALL)
    rules = read(tmp_path, ALL.replace("0.25,b.style", "0.25,b.style:0.5"))
    body, rest = rules.rules
    assert set(ALL.split()) >= set(Rule.__struct_fields__)
    assert rest == Rule(Where.parse("surroundings"))
    assert (body.name, body.size, body.share, body.palette_strength) == ("body", 0.7, 2.0, 0.5)
    assert (body.opacity, body.soft, body.adjust.saturation) == (0.9, 0.05, 0.4)
    assert (body.hold, body.boil, body.redraw) == (3, 0.2, 0.5)
    assert body.adjust.swaps == ("#000000:#ffffff",)
    assert body.brushes == ("dab", str(tmp_path / "own.png"))
    assert body.palette == tmp_path / "monet.jpg"
    assert body.direction == Direction("guides", tmp_path / "lines.json")
    assert [str(file) for file in body.style.files] == [str(tmp_path / "a.style"), "b.style"]
    assert body.where.masks == (tmp_path / "masks",)
    assert rules.where(body).camera_file == rules.camera_file == tmp_path / "cameras.json"
    assert set(rules.files) >= {rules.file, rules.camera_file, body.palette, tmp_path / "masks"}
    assert [rules.label(1), rules.label(2)] == ["body", "region 2"]


FAULTS = {
    "no TOML": ("size = ", "is not TOML: .*; rules are tables"),
    "deep": ("a = " + "[" * 8000 + "]" * 8000, "nested too deeply"),
    "not UTF-8": (b"\xff", "must be text in UTF-8, byte 0 is not"),
    "large": (" " * (MAX_BYTES + 1), f"must have at most {MAX_BYTES} bytes"),
    "empty": ("", r"must have tables \[\[region\]\], got None"),
    "no list": ('[region]\nwhere = "subject"', r"must have tables \[\[region\]\], got {"),
    "too many": (WHERE * (MAX_RULES + 1), f"at most {MAX_RULES} tables .* got {MAX_RULES + 1}"),
    "a field above": ("size = 2\n" + WHERE, r"has no 'size' above its tables.*write it below \[\[region\]\]"),
    "unknown above": ("camera = 'a'\n" + WHERE, "has no 'camera' .*did you mean 'camera_file'"),
    "camera_file": ("camera_file = 2\n" + WHERE, "camera_file must be text in quotes, got 2"),
    "text_model": ("text_model = 2\n" + WHERE, "text_model must be text in quotes, got 2"),
    "no where": ('[[region]]\nname = "x"', r"\[\[region\]\] 1 \(x\) must say where"),
    "bad where": ('[[region]]\nwhere = "subject und"', r"\[\[region\]\] 1 where must .*got"),
    "no cameras": ('[[region]]\nwhere = "mask:a.png"', r"\[\[region\]\] 1 where has mask:a.png, which needs"),
    "unknown": (WHERE + "palete = 1", r"\[\[region\]\] 1 has no 'palete'; did you mean 'palette'"),
    "second": (WHERE * 2 + "size = 9", r"\[\[region\]\] 2 size must be 0.2 to 5, got 9"),
    "type": (WHERE + 'size = "2"', "size must be a number, got '2'"),
    "no file": (None, "there is no such file; name a TOML file of rules"),
    "brushes": (WHERE + 'brushes = "dab"', "brushes must be a list of texts"),
    "no brush": (WHERE + 'brushes = [" "]', "brushes must be names .* got an empty one; remove it"),
    "no palette": (WHERE + "palette_strength = 0.5", "palette_strength needs palette.*; add it"),
    "empty palette": (WHERE + 'palette = ""', "palette must not be empty; remove it"),
    "style": (WHERE + 'style = "a.style:3"', "style must have shares of 0 to 1, got 3"),
    "direction": (WHERE + 'direction = "up"', "direction must be own, form"),
    "adjust": (WHERE + "adjust = 1", "adjust must be a table such as {saturation = 0.6}, got 1"),
    "adjust field": (WHERE + "adjust = {satur = 1}", "adjust has no 'satur'; did you mean 'saturation'"),
    "adjust type": (WHERE + "adjust = {contrast = true}", "adjust contrast must be a number, got True"),
    "name": (WHERE + "name = 3", "name must be text in quotes, got 3"),
}


@for_each(("text", "sentence"), FAULTS.values())
def test_a_fault_is_one_sentence_that_names_file_and_place(tmp_path, text, sentence):
    with pytest.raises(SceneError, match=sentence) as caught:
        Rules.of(tmp_path / "none") if text is None else read(tmp_path, text)
    assert str(caught.value).startswith(str(tmp_path))
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 600


def test_a_folder_is_no_file(tmp_path):
    with pytest.raises(SceneError, match="is a folder; name a TOML file of rules"):
        Rules.of(tmp_path)
