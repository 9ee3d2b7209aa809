"""Styles by name, share and property."""

from pathlib import Path

import pytest

import brushgs as bg
from brushgs.options.rules import Rules
from brushgs.options.styling import StyleConfig, StyleShare
from tests.kit.for_each import for_each

TEXT = "monet.style:0.8;color=1;marks=0.7;direction=0.5;line=0,dusk.style:0.2"


def test_a_config_is_read_again_from_its_text():
    for text in (TEXT, "a.style:0.5", "a b.style:1;stage=0,c.style:0"):
        config = StyleConfig.parse(text)
        assert StyleConfig.parse(str(config)) == config


@for_each(
    ("text", "sentence"),
    [
        ("a.style:1;colour=1", "style must have properties among .*, got 'colour'; did you mean 'color'"),
        ("a.style:1;line", "style must have properties such as line=0.7, got 'line'"),
        (";line=0", "style must be FILE:SHARE"),
    ],
)
def test_what_is_wrong_with_a_style_is_said_in_one_sentence(text, sentence):
    with pytest.raises(ValueError, match=sentence):
        StyleConfig.parse(text)


def test_a_look_and_rules_take_styles_as_the_flag_does(tmp_path):
    (tmp_path / "monet.style").touch()
    look = tmp_path / "mine.toml"
    look.write_text('base = "oil"\n[style]\nstyles = "monet.style:0.8;marks=0.7,other.style:0.1"\n')
    first, second = bg.Look.open(look).values["style"]["styles"]
    assert first == StyleShare(tmp_path / "monet.style", 0.8, marks=0.7)
    assert second == StyleShare(Path("other.style"), 0.1)
    look.write_text('[style]\nstyles = "monet.style;lines=0"\n')
    with pytest.raises(bg.SceneError, match="got 'lines'; did you mean 'line'"):
        bg.Look.open(look)
    rules = tmp_path / "parts.toml"
    rules.write_text('[[region]]\nwhere = "subject"\nstyle = "monet.style:0.8;line=0"\n')
    style = Rules.of(rules).rules[0].style
    assert style is not None
    assert style.styles == (StyleShare(tmp_path / "monet.style", 0.8, line=0.0),)
