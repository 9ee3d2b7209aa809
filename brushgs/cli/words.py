"""Select words of a command line by flag, as typed."""

from argparse import Action, ArgumentParser
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

# `dest` of flags that do not change the painting.
NOT_PAINTED = frozenset(
    {"output", "json", "quiet", "verbose", "debug", "config", "draw.threads"}
    | {"no_clobber", "no_metadata", "no_cache"}
)


class Piece(NamedTuple):
    """A flag with its values, or an argument without one.

    Attributes:
        action: of the flag; None for an argument.
        values: values of the flag, or the argument.
    """

    action: Action | None
    values: list[str]

    @property
    def name(self) -> str | None:
        """The long flag without dashes; None for an argument."""
        return None if self.action is None else self.action.option_strings[-1].lstrip("-")


def pieces_of(parser: ArgumentParser, words: Sequence[str]) -> Iterator[Piece]:
    """The words of a command line, each flag with its values.

    Args:
        parser: of the command.
        words: without the name of the command.
    """
    actions = {flag: action for action in parser._actions for flag in action.option_strings}
    rest = list(words)
    while rest:
        word = rest.pop(0)
        if word == "--":  # arguments follow
            yield from (Piece(None, [other]) for other in rest)
            return
        flag, equals, value = word.partition("=")
        action = actions.get(flag)
        if action is not None:
            yield Piece(action, [value] if equals else _values(action, rest))
        elif word[:2] in actions:  # -oFILE
            yield Piece(actions[word[:2]], [word[2:]])
        else:
            yield Piece(None, [word])


def words_of(parser: ArgumentParser, words: Sequence[str], is_wanted: Callable[[str], bool]) -> list[str]:
    """Flags with values, filtered by `dest`, in order, with long names.

    Args:
        parser: of the command; its flags take at most one value.
        words: accepted by the parser, with or without the command name.
        is_wanted: predicate of a flag's `dest`.
    """
    wanted = []
    for action, values in pieces_of(parser, words):
        if action is not None and is_wanted(action.dest):
            name = action.option_strings[-1]
            # A value that begins with a minus would be taken for a flag.
            wanted += [f"{name}={values[0]}"] if values and values[0].startswith("-") else [name, *values]
    return wanted


def _values(action: Action, rest: list[str]) -> list[str]:
    """Take the values of a flag from the words after it."""
    if action.nargs == 0 or not rest:
        return []
    if action.nargs is None:
        return [rest.pop(0)]
    values: list[str] = []
    while rest and not rest[0].startswith("-") and not (action.nargs == "?" and values):
        values.append(rest.pop(0))
    return values
