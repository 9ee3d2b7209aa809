"""Convert options by name and value, as in files, to command-line words.

All options thus share the choices and messages of their flags. Names are those of flags, with "_" or "-":
`fov_deg` for --fov-deg, `from_` for --from; positional arguments go by their name.
"""

import os
from argparse import Action, ArgumentParser, _AppendAction, _HelpAction
from collections.abc import Callable, Iterator, Mapping
from math import isfinite
from typing import Any

from brushgs.cli.flags import row_of_action
from brushgs.options.renamed import FLAGS
from brushgs.options.table import hint_for, shown


class OptionError(ValueError):
    """An unknown option, or an invalid value.

    Attributes:
        name: of the option, as given.
    """

    def __init__(self, name: str, rule: str) -> None:
        super().__init__(f"{name} {rule}")
        self.name = name


def named_actions(parser: ArgumentParser) -> dict[str, Action]:
    """The actions of a parser by option name: long flags without dashes, and positional arguments."""
    actions: dict[str, Action] = {}
    for action in parser._actions:
        if isinstance(action, _HelpAction):
            continue
        longs = [flag[2:] for flag in action.option_strings if flag.startswith("--")]
        actions |= dict.fromkeys(longs or [action.dest], action)
    return actions


def flag_name(name: str) -> str:
    """The flag name of an option: "from_" is "from", "look_at" is "look-at"."""
    return name.rstrip("_").replace("_", "-")


def action_named(parser: ArgumentParser, name: str) -> Action:
    """The action of an option.

    Raises:
        OptionError: if it is unknown; suggests the nearest.
    """
    actions = named_actions(parser)
    found = actions.get(FLAGS.get(flag_name(name), flag_name(name)))
    if found is None:
        cure = hint_for(flag_name(name), actions) or f"; `{parser.prog} --help` lists them"
        raise OptionError(name, f"is no option of `{parser.prog}`{cure}")
    return found


def option_values(parser: ArgumentParser, options: Mapping[str, Any]) -> Iterator[tuple[Action, Any]]:
    """Python values as their flags store them; options with value None are omitted.

    Raises:
        OptionError: if an option is unknown or its value invalid.
    """
    for name, given in options.items():
        action = action_named(parser, name)
        if given is None or (given is False and action.nargs == 0):
            continue
        row = row_of_action(action)
        try:
            if action.nargs == 0 and given is not True:
                raise ValueError(f"must be true or false, got {shown(given)}")
            yield action, given if row is None or action.nargs == 0 else row.value(given)
        except ValueError as error:
            raise OptionError(name, str(error)) from None


def option_words(
    parser: ArgumentParser,
    options: Mapping[str, Any],
    located: Callable[[Action, str], str] = lambda action, text: text,
) -> list[str]:
    """The equivalent command-line words, positional arguments first.

    A value is text, a number, a path, true or false for a switch, or a list: of numbers ([1280, 720] for
    size, [0, 1.5, -2] for look-at), of names, or of values of a repeatable flag. Some flags take a table:
    {contrast = 1.2} for adjust. Options with value None are omitted.

    Args:
        parser: of the command.
        options: name -> value.
        located: resolves file names in the text of a flag.

    Raises:
        OptionError: if an option is unknown or its value invalid.
    """
    arguments: list[str] = []
    flags: list[str] = []
    for name, value in options.items():
        action = action_named(parser, name)
        if value is None:
            continue
        texts = [located(action, text) for text in _texts(action, name, value)]
        for text in texts:
            _check(action, name, text)
        if not action.option_strings:
            arguments += [f"./{text}" if text.startswith("-") else text for text in texts]
        else:
            flags += _flag_words(action, texts, is_bare=value is True)
    return [*arguments, *flags]


def _flag_words(action: Action, texts: list[str], *, is_bare: bool) -> Iterator[str]:
    flag = action.option_strings[-1]
    if action.nargs in ("+", "*"):
        yield from (flag, *texts)
    elif texts:
        yield from (f"{flag}={text}" for text in texts)
    elif is_bare:
        yield flag


def _texts(action: Action, name: str, value: Any) -> list[str]:
    """The texts of a value: none for a switch, several for a flag with several values."""
    if action.nargs == 0 or (action.nargs == "?" and action.option_strings and isinstance(value, bool)):
        if not isinstance(value, bool):
            raise OptionError(name, f"must be true or false, got {shown(value)}")
        return []
    takes_several = isinstance(action, _AppendAction) or action.nargs in ("+", "*")
    if takes_several and isinstance(value, list | tuple):
        return [_text(action, name, item) for item in value]
    return [_text(action, name, value)]


def _text(action: Action, name: str, value: Any) -> str:
    row = row_of_action(action)
    between, after_key = (",", "") if row is None else row.option.written
    if isinstance(value, bool) and row is not None and row.takes_on_off:
        return "on" if value else "off"
    if isinstance(value, list | tuple) and value:
        return between.join(_plain(name, item) for item in value)
    if isinstance(value, Mapping) and value and after_key:
        return between.join(f"{key}{after_key}{_plain(name, item)}" for key, item in value.items())
    return _plain(name, value)


def _plain(name: str, value: Any) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, os.PathLike):
        return os.fsdecode(value)
    if isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value):
        return repr(value)
    raise OptionError(name, f"must be text or a number as its flag takes, got {shown(value)}")


def _check(action: Action, name: str, text: str) -> None:
    """Raise the error of the flag for an invalid text, with the option's name as given."""
    row = row_of_action(action)
    try:
        if row is not None and action.nargs != 0:
            row.read(text)
    except ValueError as error:
        raise OptionError(name, str(error)) from None
