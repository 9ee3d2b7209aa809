"""`info --words` says in words what is seen, each word with its figure."""

import json

import brushgs as bg
from tests.kit.commands import run
from tests.scenes import still_life_of


def test_words_of_a_scene_are_those_of_its_first_view_and_of_strokes_tell_of_their_marks(tmp_path, capsys):
    scene, strokes = tmp_path / "a.ply", tmp_path / "strokes.ply"
    bg.save(still_life_of(3000), scene)
    assert run(capsys, "cluster", scene, "--strokes", "150", "-o", strokes, "--quiet")[0] == 0
    words, of_strokes = (
        {
            word["word"]: word
            for word in json.loads(run(capsys, "info", file, "--words", "--json")[1])["words"]
        }
        for file in (scene, strokes)
    )
    assert {"warm", "dark"} <= set(words)
    fits = [word["fit"] for word in words.values()]
    assert (fits, words["warm"]["figure"]) == (sorted(fits, reverse=True), "warmth")
    assert 0.3 < words["warm"]["value"] < 1
    assert "broad" in of_strokes
    assert "fine" not in of_strokes
