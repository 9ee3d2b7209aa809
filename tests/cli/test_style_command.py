"""`brushgs style learn` writes a style, `brushgs style show` says what is in one."""

import json

import numpy as np
import pytest

import brushgs as bg
from brushgs.cli import main
from tests.io.styles import example


@pytest.fixture
def painting(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rgb = np.zeros((30, 40, 3), np.float32)  # too small for marks, whose lessons take seconds
    rgb[:, :25], rgb[:, 25:] = (0.1, 0.2, 0.6), (0.9, 0.7, 0.2)
    rgb += np.random.default_rng(0).normal(0, 0.02, rgb.shape).astype(np.float32)
    path = tmp_path / "dusk.png"
    bg.save(bg.Frame(np.clip(rgb, 0, 1), np.ones((30, 40), np.float32), None), path)
    return path


def run(capsys, *words):
    code = main(["style", *map(str, words)])
    out, err = capsys.readouterr()
    return code, out.strip(), err.strip()


def test_learn_writes_a_style_named_after_the_painting(painting, capsys):
    code, out, err = run(capsys, "learn", painting)
    assert (code, out) == (0, "dusk.style")
    assert "palette" in err
    style = bg.load_style("dusk.style")
    assert (style.name, style.kind) == ("dusk", "painting")
    names = [color.name for color in style.palette.colors]
    assert any("blue" in name for name in names)


def test_the_python_function_learns_the_same(painting, capsys):
    assert run(capsys, "learn", painting, "--quiet") == (0, "", "")
    bg.save_style(bg.learn_style(painting), "again.style")
    assert (painting.parent / "again.style").read_bytes() == (painting.parent / "dusk.style").read_bytes()


def test_show_prints_names_codes_and_shares(tmp_path, capsys):
    path = tmp_path / "evening.style"
    bg.save_style(example.painting(), path)
    code, out, err = run(capsys, "show", path)
    assert (code, err) == (0, "")
    assert "#1f3a6b  deep blue    50.0 %" in out
    assert "marks aspect             4.25" in out
    code, out, _ = run(capsys, "show", path, "--json")
    facts = json.loads(out)
    assert facts["kind"] == "painting"
    assert facts["palette"][1] == {"name": "ochre", "color": "#c28a37", "share": 0.3}
    assert facts["marks"]["brushes"] == 2


def test_show_tells_of_an_edit(tmp_path, capsys):
    path = tmp_path / "warm.style"
    bg.save_style(example.edit(), path)
    assert "edit residual            7 bumps" in run(capsys, "show", path)[1]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["learn"], "style learn needs a painting; name it"),
        (["show", "a.style", "--name", "b"], "--name belongs to `brushgs style learn`; remove it"),
        (["learn", "missing.png"], "missing.png: there is no such picture; check the path"),
        (["show", "dusk.png"], "dusk.png: is no style file"),
    ],
)
def test_wrong_words_are_refused_in_a_sentence(painting, capsys, words, sentence):
    code, out, err = run(capsys, *words)
    assert (code, out) == (2, "")
    assert sentence in err
    assert "\n" not in err


def test_the_painting_is_never_overwritten(painting, capsys):
    painting.rename("a.style")
    code, _, err = run(capsys, "learn", "a.style", "-o", "./a.style")
    assert code == 2
    assert "is the input, which is never overwritten" in err
