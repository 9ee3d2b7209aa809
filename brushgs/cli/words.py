"""The words of a command line again: those that say one kind of thing, as they were typed."""

from argparse import Action, ArgumentParser
from collections.abc import Callable, Sequence

# `dest` of flags of a command that paints, which decide nothing of what is painted.
NOT_PAINTED = frozenset({"output", "json", "quiet", "verbose", "debug", "draw.threads"})


def words_of(parser: ArgumentParser, words: Sequence[str], is_wanted: Callable[[str], bool]) -> list[str]:
    """The flags with their values whose `dest` is wanted, in order; a flag that was shortened is whole again.

    Args:
        parser: of the command, whose flags take one value or none.
        words: which the parser has accepted, with or without the name of the command.
        is_wanted: of the `dest` of a flag.
    """
    actions = {flag: action for action in parser._actions for flag in action.option_strings}
    wanted, rest = [], list(words)
    while rest:
        word = rest.pop(0)
        flag, equals, value = word.partition("=")
        action = _action_of(flag, actions)
        if action is None:  # a file, or -oFILE
            continue
        values = [value] if equals else [rest.pop(0)] if action.nargs is None else []
        if is_wanted(action.dest):
            name = action.option_strings[-1]
            # A value that begins with a minus would be taken for a flag.
            wanted += [f"{name}={values[0]}"] if values and values[0].startswith("-") else [name, *values]
    return wanted


def _action_of(flag: str, actions: dict[str, Action]) -> Action | None:
    if flag in actions or not flag.startswith("--"):
        return actions.get(flag)
    return next((action for name, action in actions.items() if name.startswith(flag)), None)
