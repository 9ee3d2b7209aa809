"""`info --words` and `style show` say in words what is seen, each word with its figure."""

import json

import numpy as np
import pytest

import brushgs as bg
from brushgs.cli import main
from brushgs.values.style import NamedColor, Style, StylePalette
from tests.scenes import still_life_of


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "a.ply"
    bg.save(still_life_of(3000), path)
    return path


def run(capsys, *words):
    code = main([*map(str, words)])
    out, err = capsys.readouterr()
    return code, out, err


def test_words_of_a_scene_are_those_of_its_first_view(scene, capsys):
    code, out, _ = run(capsys, "info", scene, "--words", "--json")
    words = json.loads(out)["words"]
    assert code == 0
    assert {"warm", "dark"} <= {word["word"] for word in words}
    assert [word["fit"] for word in words] == sorted((word["fit"] for word in words), reverse=True)
    warm = next(word for word in words if word["word"] == "warm")
    assert warm["figure"] == "warmth"
    assert 0.3 < warm["value"] < 1


def test_words_of_strokes_tell_of_their_marks(scene, tmp_path, capsys):
    strokes = tmp_path / "strokes.ply"
    assert main(["cluster", str(scene), "--strokes", "150", "-o", str(strokes), "--quiet"]) == 0
    few = {word["word"] for word in json.loads(run(capsys, "info", strokes, "--words", "--json")[1])["words"]}
    assert "broad" in few
    assert "fine" not in few


def test_a_style_is_shown_in_words(tmp_path, capsys):
    offset = np.zeros((12, 3), np.float32)
    colors = (NamedColor("one", np.array([0.1, 0.2, 0.6]), 0.8, offset),)
    colors += (NamedColor("two", np.array([0.0, 0.0, 0.0]), 0.2, offset),)
    path = tmp_path / "a.style"
    bg.save_style(Style("a", palette=StylePalette(colors)), path)
    _, out, _ = run(capsys, "style", "show", path)
    assert "no language model" in out
    assert "cool" in out.split("in words")[1]
    _, out, _ = run(capsys, "style", "show", path, "--json")
    assert {"cool", "dark"} <= {word["word"] for word in json.loads(out)["words"]}
