"""Options by name are the words that one would type: each flag of `render`, and what no flag takes."""

from pathlib import Path

import pytest

from brushgs.cli.option_words import OptionError, named_actions, option_words
from brushgs.cli.parser import COMMANDS, command_parser
from tests.kit.for_each import for_each

RENDER = command_parser("render")


def test_none_and_false_are_options_that_are_omitted():
    assert option_words(RENDER, {"size": None, "loop": False, "scene": None}) == []


def test_several_values_of_one_flag_stay_its_values():
    looks = command_parser("looks")
    args = looks.parse_args(option_words(looks, {"looks": ["ink"], "scene": ["a.ply", "b.ply"], "time": 1}))
    assert (args.looks, args.scene) == (["ink"], [Path("a.ply"), Path("b.ply")])


@for_each(
    ("name", "value", "message"),
    [
        ("strokez", 3, "strokez is no option of `brushgs render`; did you mean 'stroke'"),
        ("qqqq", 3, "lists them"),
        ("help", True, "help is no option"),
        ("size", 12, "size must be WIDTHxHEIGHT in pixels"),
        ("size", (0, 5), "size must be"),
        ("size", [], r"must be text or a number as its flag takes, got \[\]"),
        ("pan", (1, 2, 3), "pan must be 2 numbers separated by commas, got '1,2,3'"),
        ("strokes", 0.5, "strokes must be a count of 1 or more, a share such as 10%"),
        ("strokes", True, "must be text or a number"),
        ("azimuth", float("nan"), "must be text or a number"),
        ("loop", 1, "loop must be true or false, got 1"),
        ("filter", "mipp", "filter must be one of mip, bilinear, nearest, got 'mipp'; did you mean 'mip'"),
        ("solid", "yes", "solid must be on or off, got 'yes'"),
        ("swap", [["#ff0000", "#00ff00"]], "swap must be"),
        ("look", {"name": "oil"}, "look must be text or a number"),
        ("adjust", {"contrast": 9}, "adjust contrast must be 0 to 3, got 9"),
        ("look", object(), "must be text or a number"),
    ],
)
def test_what_a_flag_does_not_take_is_refused_by_name(name, value, message):
    with pytest.raises(OptionError, match=message) as caught:
        option_words(RENDER, {name: value})
    assert caught.value.name == name


@for_each("command", COMMANDS)
def test_flags_of_all_commands_have_names(command):
    actions = named_actions(command_parser(command))
    assert "debug" in actions
    assert all(name.replace("-", "").isalnum() for name in actions)
