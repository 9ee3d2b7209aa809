"""Laws of all options at once: range, default, words, flag, text, files and keywords are those of one
line."""

from argparse import SUPPRESS
from math import degrees, inf, nan
from pathlib import Path
from typing import get_args

import pytest

from brushgs.cli.flags import CLASSES, add_row
from brushgs.cli.parser import COMMANDS, command_parser
from brushgs.options.media import MEDIA
from brushgs.options.table import Options, Row, row_of, rows_of, values_of
from brushgs.options.where import Where
from tests.kit.for_each import for_each

KINDS = sorted({kind for kinds in CLASSES.values() for kind in kinds} | set(MEDIA.values()), key=repr)
# What a class needs beside a field that is tried.
NEEDED = {
    "PathConfig": {"orbit": 9},
    "GrowConfig": {"seconds": 3.0},
    "PaletteConfig": {"file": Path("a.png")},
    "distance": {"look_at": (0.0, 1.0, 2.0)},
    "cross_fade": {"loop": True},
    "weights": {"style": Path("a.png")},
    "style_layers": {"style": Path("a.png")},
    "style_loss": {"style": Path("a.png")},
    "frames": {"file": Path("p.json"), "orbit": None},
    "seconds": {"file": Path("p.json"), "orbit": None},
    "certificate": {"key": Path("k.pem")},
    "key": {"certificate": Path("c.pem")},
    "SceneSource": {"paths": (Path("a.ply"),)},
    "WhereConfig": {"expression": Where.parse("subject")},
}


def of_each_class(law):
    """A law of every option of every class."""
    options = [(kind, row) for kind in KINDS for row in rows_of(kind) if row.option.words]
    return for_each(("kind", "row"), options)(law)


def bounds(row):
    """The ends of a range with whether they belong to it, in the unit of the user."""
    option = row.option
    return [
        (bound, is_in, sign)
        for bound, is_in, sign in (
            (option.ge, True, -1),
            (option.gt, False, -1),
            (option.le, True, 1),
            (option.lt, False, 1),
        )
        if bound is not None
    ]


def in_shape(row, number):
    """A number in the unit of the user as a value of a row."""
    kind = row.kinds[0]
    if kind is int:
        return int(number)
    held = row._held(float(number))
    return (held,) * len(get_args(kind)) if str(kind).startswith("tuple") else held


def is_numeric(row):
    return bool(row.option.span) and (row.kinds[0] in (int, float) or "tuple" in str(row.kinds[0]))


@of_each_class
def test_a_range_is_that_of_the_constructor_and_of_the_sentence(kind, row):
    if not is_numeric(row):
        return

    def checked(number):
        row.check(in_shape(row, number))

    for bound, is_in, sign in bounds(row):
        if is_in:
            checked(bound)
        else:
            with pytest.raises(ValueError, match=f"^{row.name} must be "):
                checked(bound)
        beyond = bound + sign * max(1, abs(bound))
        with pytest.raises(ValueError, match=f"^{row.name} must be ") as caught:
            checked(beyond)
        assert row.option.span in str(caught.value)
        if row.kinds[0] is float:
            for number in (nan, inf, -inf):
                with pytest.raises(ValueError, match=f"^{row.name} must be "):
                    checked(number)
        more = NEEDED.get(kind.__name__, {}) | NEEDED.get(row.field, {})
        more = {name: value for name, value in more.items() if name in kind.__struct_fields__}
        if (kind.__name__, row.field) != ("PathConfig", "fps"):  # of which the class says more
            with pytest.raises(ValueError, match=f"^{row.name} must be "):
                kind(**more | {row.field: in_shape(row, beyond)})
    assert row.option.span in row.help()


@of_each_class
def test_a_json_schema_has_the_range_and_the_choices(kind, row):
    schema = row.schema()
    assert schema["description"] == row.words
    number = schema.get("items", schema)
    assert number.get("enum", []) == list(row.choices or ())
    limits = {"minimum": (0, True), "exclusiveMinimum": (0, False), "maximum": (1, True)}
    for name, (bound, is_in) in limits.items():
        if number.get(name) == bound:
            assert row.option.holds(bound) == is_in


@of_each_class
def test_a_default_that_help_shows_is_read_back(kind, row):
    if not row.flags:
        return
    if row.default in (None, ()) or row.is_switch or row.option.action == "append":
        return
    if row.option.read is None or isinstance(row.default, str | tuple):
        assert row.read(row.text_of(row.default)) == pytest.approx(row.default)


@of_each_class
def test_text_files_and_keywords_give_the_same(kind, row):
    if not row.flags:
        return
    if row.default is None or row.option.read is not None or row.option.action is not None:
        return
    text = row.text_of(row.default)
    if row.choices is None and row.kinds[0] in (int, float):
        number = degrees(row.default) if row.option.unit == "degrees" else row.default
        assert row.value(number) == row.value(number, is_strict=True) == pytest.approx(row.read(text))
        for wrong in ("x", "", "1,2", True, None, [1], {}):
            if isinstance(wrong, str):
                with pytest.raises(ValueError, match="must be a"):
                    row.value(wrong)
            with pytest.raises(ValueError, match="must be a"):
                row.value(wrong, is_strict=True)
    elif row.choices is not None:
        for choice in row.choices:
            assert row.value(choice) == row.value(choice, is_strict=True) == row.read(choice) == choice
        with pytest.raises(ValueError, match=r"must be one of .* did you mean"):
            row.value(row.choices[-1] + "x")


@for_each("command", COMMANDS)
def test_every_flag_of_a_command_is_made_of_the_table(command):
    own = {"debug", "config"}
    for action in command_parser(command)._actions:
        if action.dest not in {*own, SUPPRESS}:
            assert isinstance(action.row, Row), action.option_strings


@for_each("kind", KINDS)
def test_options_are_values(kind):
    rows = rows_of(kind)
    if all(
        name in NEEDED.get(kind.__name__, {}) or row_of(kind, name).default is not None
        for name in kind.__struct_fields__
    ):
        one, other = (kind(**NEEDED.get(kind.__name__, {})) for _ in range(2))
        assert one == other
        assert hash(one) == hash(other)
        assert kind(**values_of(one)) == one
    assert [row.field for row in rows] == list(kind.__struct_fields__)


def test_an_option_is_added_with_one_line():
    from argparse import ArgumentParser
    from typing import Annotated

    from brushgs.options.table import option

    class New(Options, frozen=True):
        depth: Annotated[float, option("how deep", ge=0, le=4, unit="m", metavar="M")] = 2.0

    parser = ArgumentParser()
    add_row(parser, rows_of(New)[0], "new")
    assert vars(parser.parse_args(["--depth", "3"])) == {"new.depth": 3.0}
    assert vars(parser.parse_args([])) == {}
    assert "how deep; 0 to 4 m; default 2" in parser.format_help()
    with pytest.raises(ValueError, match="depth must be 0 to 4 m, got 5"):
        New(depth=5)
    with pytest.raises(ValueError, match="depth must be a number, got 'x'"):
        New(depth="x")
