"""Help: the main options with examples, one group of options, and a search for options."""

import textwrap
from argparse import SUPPRESS, Action, ArgumentParser, Namespace, _HelpAction
from collections.abc import Iterator, Sequence
from typing import Any

from brushgs.cli.flags import row_of_action
from brushgs.options.table import Row, hint_for

WIDTH, LEFT = 96, 30  # columns in total; for flags
SHORTEST = 20  # commands with at most this many flags show all
MOST_FOUND = 12  # limit of search results
# Words ignored in a search.
EMPTY = {"a", "the", "of", "to", "in", "how", "with", "set", "change", "my", "option", "flag"}


def add_help(parser: ArgumentParser, *, has_short: bool = True) -> None:
    """Add the flags -h (main options) and --help (all options)."""
    if not has_short:
        parser.add_argument("-h", "--help", action=_HelpAction, dest=SUPPRESS, help="show this, and quit")
        return
    words = "show the main options, with examples"
    parser.add_argument("-h", action=ShortHelp, dest=SUPPRESS, help=words)
    parser.add_argument("--help", action=_HelpAction, dest=SUPPRESS, help="show all options, by group")


class ShortHelp(_HelpAction):
    """Print the options with an example (all, if there are few), and quit."""

    def __call__(self, parser: ArgumentParser, namespace: Namespace, values: Any, flag: Any = None) -> None:
        """Print them."""
        found = [(action, row) for action, row in _rows(parser) if row.option.example]
        if len(list(_rows(parser))) <= SHORTEST or len(found) < 3:
            super().__call__(parser, namespace, values, flag)
        arguments = [action.metavar or action.dest for action in parser._positionals._group_actions]
        print(f"usage: {parser.prog} {' '.join(map(str, arguments))} [options]\n")
        for action, row in found:
            print(_entry(f"{action.option_strings[-1]} {row.option.example}", _first_words(action)))
        count = len(list(_rows(parser)))
        print(
            f"\n`{parser.prog} --help` lists all {count} options, `brushgs help light` one group of them,\n"
            "`brushgs help brush size` finds one."
        )
        parser.exit()


def _rows(parser: ArgumentParser) -> Iterator[tuple[Action, Row]]:
    """The flags of a command with their options."""
    for action in parser._actions:
        row = row_of_action(action)
        if row is not None and action.option_strings:
            yield action, row


def _words(action: Action) -> str:
    return str(action.help).replace("%%", "%")


def _first_words(action: Action) -> str:
    """The first phrase of an option's help."""
    words = _words(action).split("; ")[0].split(": ")[0]
    return textwrap.shorten(words, WIDTH - LEFT, placeholder=" ...")


def _entry(left: str, words: str) -> str:
    text = textwrap.fill(words, WIDTH, initial_indent=" " * LEFT, subsequent_indent=" " * LEFT)
    start = f"  {left}"
    return start + text[len(start) :] if len(start) < LEFT else f"{start}\n{text}"


def found_by(parser: ArgumentParser, words: Sequence[str]) -> str:
    """Help for a group by its name, or for options found by search words.

    Raises:
        ValueError: if nothing matches.
    """
    asked = [word for text in words for word in text.lower().replace("-", " ").split() if word not in EMPTY]
    title = " ".join(asked)
    groups = {group.title: group for group in parser._action_groups if group.title and group._group_actions}
    steps = {action.dest.partition(".")[0] for action, _ in _rows(parser) if "." in action.dest}
    if title in groups or title in steps:
        picked = [
            (action, row)
            for action, row in _rows(parser)
            if action.dest.startswith(f"{title}.")
            or action in getattr(groups.get(title), "_group_actions", ())
        ]
        about = (
            groups[title].description if title in groups else str(picked[0][1].of.__doc__).partition("\n")[0]
        )
        head = f"{title}: {about}" if about else title
    else:
        picked = _by_words(parser, asked, [*groups, *steps])
        head = f"options of `{parser.prog}` for {title!r}:"
    lines = [
        _entry(" ".join([action.option_strings[-1], *_value(action)]), _words(action)) for action, _ in picked
    ]
    return "\n".join([textwrap.fill(" ".join(head.split()), WIDTH), "", *lines])


def _by_words(
    parser: ArgumentParser, asked: Sequence[str], others: Sequence[str]
) -> list[tuple[Action, Row]]:
    """Options whose names or tags include all words; `others` are group names, for a hint."""
    rows = list(_rows(parser))
    picked = [(action, row) for action, row in rows if asked and _score(row, asked) == len(asked)]
    if not picked:
        known = sorted({*others, *(tag for _, row in rows for tag in _names(row))} - {""})
        title = " ".join(asked)
        raise ValueError(
            f"help finds no command, group or option by {title!r}{hint_for(title, known)}; "
            f"`{parser.prog} --help` lists all"
        )
    return picked[:MOST_FOUND]


def _value(action: Action) -> list[str]:
    """The placeholder of a flag's value."""
    if action.choices is not None:
        return ["|".join(map(str, action.choices))]
    return [str(action.metavar)] if action.metavar else []


def _names(row: Row) -> set[str]:
    """Search words of an option."""
    return {*row.tags, *row.name.split("-"), *row.field.split("_")}


def _score(row: Row, asked: Sequence[str]) -> int:
    names = _names(row)
    return sum(word in names or word.removesuffix("s") in names or f"{word}s" in names for word in asked)
