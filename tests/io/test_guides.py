"""Files of guides: what they may hold, and the sentence for what they may not."""

import json

from brushgs.formats.guides import MAX_LINE, read_guides
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse, refuse_bytes

OBJ = "v 0 0 0\nv 1 0 0\nv 1 2 0\n"


def read(folder, text, suffix=".obj"):
    path = folder / f"guides{suffix}"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_guides(path)


def corners(guides):
    return [(*a, *b) for a, b in zip(guides.starts.tolist(), guides.ends.tolist(), strict=True)]


BOTH = [(0, 0, 0, 1, 0, 0), (1, 0, 0, 1, 2, 0)]


@for_each(
    "lines",
    [
        "l 1 2\nl 2 3\n",  # one edge a line, as Blender writes them
        "l -3 -2 -1",
        "o Curve\nvn 0 0 1\nl 1/1 2/5 3\nf 1 2 3\nusemtl (null)\n",
        "g a\r\nl\t1  2   3\r\n\r\n# a comment\r\n",
        "l 1\nl 1 2 2 3\n",  # a single point, and a point twice, are no segment
    ],
)
def test_other_ways_to_write_them(tmp_path, lines):
    assert corners(read(tmp_path, OBJ + lines)) == BOTH


def test_json_lists_and_objects(tmp_path):
    lines = [[[0, 0, 0], [1, 0, 0], [1, 2, 0]], [], [[5, 5, 5]]]
    assert corners(read(tmp_path, json.dumps(lines), ".json")) == BOTH
    guides = read(tmp_path, json.dumps({"reach": 2, "guides": lines}), ".JSON")
    assert (corners(guides), guides.reach) == (BOTH, 2.0)


NO_LINE = "holds no line.*draw a line of two points or more"
BAD_OBJ = {
    "": NO_LINE,
    OBJ: "holds no line, only 3 points; draw",
    OBJ + "l 2 2": NO_LINE,
    OBJ + "l 1 4": r"runs to point 4 of 3; write points as 'v 0 1\.5 2' and lines as 'l 1 2 3', numbered",
    OBJ + "l 1 0": 'line 4: "0" is no point',
    OBJ + "l 1 -4": 'line 4: "-4" is no point',
    OBJ + "l 1 two": 'line 4: "two" is no point',
    OBJ + "l 1 99999999999999999999": "is no point",
    "v 0 0\n" + OBJ + "l 1 2": "line 1 must hold three coordinates; write points as",
    "v 0 a 0\n" + OBJ + "l 1 2": "line 1 must hold three coordinates",
    "v 0 nan 0\nv 1 1 1\nl 1 2": r"point 1 must have finite coordinates up to 1e\+15, got \[0.0, nan, 0.0\]",
    "# reach far\n" + OBJ + "l 1 2": "line 1: 'reach' must be a number; write '# reach 0.5'",
    "# reach 0\n" + OBJ + "l 1 2": "'reach' must be a distance above 0 in world units, got 0; correct it",
    "v 0 0 0 " + "1 " * MAX_LINE: f"line 1 has more than {MAX_LINE} bytes; split it",
    "l " + "1 2 " * 9000 + "\xff": "is no point",
}
BAD_JSON = {
    "[": "is not JSON",
    "[]": NO_LINE,
    "[[[0,0,0]]]": NO_LINE,
    "[[0,0,0],[1,0,0]]": r"lines\[0\]\[0\] must be a point \[x, y, z\], got 0; write lines",
    "[[[0,0,0],[1,0]]]": r"lines\[0\]\[1\] must be a point \[x, y, z\], got \[1, 0\]",
    "[[[0,0,0],[1,0,true]]]": r"lines\[0\]\[1\]\[2\] must be a finite number, got true",
    "[[[0,0,0],[1,0,NaN]]]": r"lines\[0\]\[1\]\[2\] must be a finite number, got NaN",
    "3": "must be a list of lines, got 3",
    '{"lines": []}': "lines is no known field among guides, reach; remove or correct it",
    '{"guides": {}}': "guides must be a list of lines, got {}; write lines",
    '{"guides": [[[0,0,0],[1,0,0]]], "reach": "1"}': 'reach must be a finite number, got "1"',
    '{"guides": [[[0,0,0],[1,0,0]]], "reach": -1}': "'reach' must be a distance above 0",
    "[" * 5000: "nested too deeply",
}
BAD = [(text, ".obj", rule) for text, rule in BAD_OBJ.items()]
BAD += [(text, ".json", rule) for text, rule in BAD_JSON.items()]


@for_each("text, suffix, message", BAD)
def test_bad_files_are_refused_in_a_sentence_with_the_cure(tmp_path, text, suffix, message):
    assert "; " in refuse_bytes(tmp_path / f"guides{suffix}", text.encode(), message, read_guides)


def test_other_files_folders_and_too_many_points_are_refused(tmp_path, monkeypatch):
    refuse(tmp_path / "guides.ply", "is no file of guides of a known format; give OBJ", read_guides)
    refuse(tmp_path / "guides.obj", "there is no such file", read_guides)
    (tmp_path / "a.obj").mkdir()
    refuse(tmp_path / "a.obj", "is a folder", read_guides)
    monkeypatch.setattr("brushgs.formats.guides.MAX_POINTS", 1000)
    for content in (b"v 0 0 0\n" * 1001, b"v 0 0 0\nv 1 0 0\n" + b"l 1 2 1 2\n" * 1000):
        sentence = "holds more than 1000 points; simplify the lines"
        refuse_bytes(tmp_path / "b.obj", content, sentence, read_guides)
