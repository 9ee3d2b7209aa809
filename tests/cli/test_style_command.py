"""`brushgs style learn` writes a style, `brushgs style show` says what is in one."""

import json

import numpy as np
import pytest

import brushgs as bg
from brushgs.values.style import NamedColor, Style, StylePalette
from tests.io.styles import example
from tests.kit.commands import refused, run, save_opaque
from tests.kit.for_each import for_each


@pytest.fixture
def painting(folder):
    rgb = np.zeros((30, 40, 3))  # too small for marks, whose lessons take seconds
    rgb[:, :25], rgb[:, 25:] = (0.1, 0.2, 0.6), (0.9, 0.7, 0.2)
    rgb += np.random.default_rng(0).normal(0, 0.02, rgb.shape)
    save_opaque("dusk.png", np.clip(rgb, 0, 1))
    return folder / "dusk.png"


def test_learn_writes_a_style_named_after_the_painting(painting, capsys):
    code, out, err = run(capsys, "style", "learn", painting)
    assert (code, out) == (0, "dusk.style\n")
    assert "palette" in err
    style = bg.load_style("dusk.style")
    assert (style.name, style.kind) == ("dusk", "painting")
    assert any("blue" in color.name for color in style.palette.colors)
    bg.save_style(bg.learn_style(painting), "again.style")
    assert (painting.parent / "again.style").read_bytes() == (painting.parent / "dusk.style").read_bytes()


def test_show_prints_what_is_in_a_style_and_says_it_in_words(folder, capsys):
    bg.save_style(example.painting(), "evening.style")
    code, out, err = run(capsys, "style", "show", "evening.style")
    assert (code, err) == (0, "")
    assert "#1f3a6b  deep blue    50.0 %" in out
    assert "marks aspect             4.25" in out
    facts = json.loads(run(capsys, "style", "show", "evening.style", "--json")[1])
    assert facts["kind"] == "painting"
    assert facts["palette"][1] == {"name": "ochre", "color": "#c28a37", "share": 0.3}
    assert facts["marks"]["brushes"] == 2
    bg.save_style(example.edit(), "warm.style")
    assert "edit residual            7 bumps" in run(capsys, "style", "show", "warm.style")[1]
    offset = np.zeros((12, 3), np.float32)
    blue, black = ((0.1, 0.2, 0.6), 0.8), ((0, 0, 0), 0.2)
    colors = tuple(NamedColor("one", np.array(rgb, float), share, offset) for rgb, share in (blue, black))
    bg.save_style(Style("a", palette=StylePalette(colors)), "a.style")
    _, out, _ = run(capsys, "style", "show", "a.style")
    assert "no language model" in out
    assert "cool" in out.split("in words")[1]
    words = json.loads(run(capsys, "style", "show", "a.style", "--json")[1])["words"]
    assert {"cool", "dark"} <= {word["word"] for word in words}


@for_each(
    ("words", "sentence"),
    [
        (["learn"], "style learn needs a painting; name it"),
        (["show", "a.style", "--name", "b"], "--name belongs to `brushgs style learn`; remove it"),
        (["learn", "dusk.png", "--up", "+x"], "--up belongs to --before and --after; a painting has none"),
        (["learn", "missing.png"], "missing.png: there is no such picture; check the path"),
        (["show", "dusk.png"], "dusk.png: is no style file"),
    ],
)
def test_wrong_words_are_refused_in_a_sentence(painting, capsys, words, sentence):
    assert sentence in refused(capsys, "style", *words)
