"""`--config FILE`: options in TOML, named after their flags; the command line overrides them.

    size = "1920x1080"              # of every command that has such a flag
    azimuth = 30
    [render]                        # of one command
    look = "charcoal"
    layers = ["depth", "normal"]

A flag on the command line also overrides its rivals (--from overrides `azimuth`). Input paths are relative to
the config file or the current folder; outputs are written relative to the current folder.
"""

import os
import re
from argparse import Action, ArgumentParser
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from brushgs.cli.option_words import OptionError, action_named, flag_name, named_actions, option_words
from brushgs.cli.words import pieces_of
from brushgs.errors import SceneError
from brushgs.options.choices import PLAIN_LOOK
from brushgs.options.combinations import RIVALS
from brushgs.options.table import hint_for

CONFIG = "config"  # the flag
MAX_BYTES = 1 << 16  # of a file
OUTPUTS = {"output", "report", "sheet"}  # `dest` of outputs, which are not resolved
# Flag values that imply the plain look, and so replace a look.
PLAIN = {("stroke", "gaussian"), ("preset", "paper")}


def add_config(parser: ArgumentParser) -> None:
    """Add the flag --config (`args.config`), which every command has."""
    parser.add_argument(
        f"--{CONFIG}",
        type=Path,
        metavar="FILE",
        help="TOML file of options named after flags, for all commands, or in tables such as [render] for "
        "one; flags override it; paths are relative to it or the current folder; default none",
    )


def with_config(parser: ArgumentParser, commands: Mapping[str, Any], words: Sequence[str]) -> list[str]:
    """Command-line words with those of the --config file added; unchanged without the flag.

    Args:
        parser: of the command.
        commands: command name -> maker of its parser.
        words: command name and arguments.

    Raises:
        SceneError: if the file cannot be read or an option is invalid; names file, line and cure.
    """
    command, *rest = words
    pieces = list(pieces_of(parser, rest))
    files = [piece.values[-1] for piece in pieces if piece.name == CONFIG and piece.values]
    if not files:
        return list(words)
    path = Path(files[-1])
    given = {piece.name: piece.values for piece in pieces if piece.name is not None}
    options = dict(_options(path, parser, command, commands))
    for name in beaten(given, options):
        del options[name]
    has_arguments = any(piece.name is None for piece in pieces)
    arguments = {name for name in options if not action_named(parser, name).option_strings}
    first = [] if has_arguments else _words(path, parser, command, {n: options[n] for n in arguments})
    more = _words(path, parser, command, {n: v for n, v in options.items() if n not in arguments})
    end = rest.index("--") if "--" in rest else len(rest)
    return [command, *first, *rest[:end], *more, *rest[end:]]


def beaten(given: Mapping[str, Sequence[str]], options: Mapping[str, Any]) -> set[str]:
    """Names of `options` that are overridden by `given` (flag name -> texts), directly or as rivals."""
    rivals = {name for group in RIVALS if group & given.keys() for name in group}
    if any((name, *values) in PLAIN for name, values in given.items()):
        rivals.add("look")
    if given.get("look", (PLAIN_LOOK,))[-1] != PLAIN_LOOK:
        rivals |= {name for name, value in options.items() if (name, value) in PLAIN}
    return (rivals | given.keys()) & options.keys()


def _options(
    path: Path, parser: ArgumentParser, command: str, commands: Mapping[str, Any]
) -> Iterator[tuple[str, Any]]:
    """Options of a file for a command, by flag name; those of its table come last."""
    from brushgs.options.toml_values import read_text, read_toml

    text = read_text(path, "a file of options", MAX_BYTES)
    content = read_toml(text, path, "write options by the names of their flags, such as look = 'oil'")
    known, tables = named_actions(parser), {}
    for key, value in content.items():
        name = flag_name(key)
        if isinstance(value, dict) and key in commands:
            tables[key] = value
        elif name == CONFIG:
            raise SceneError(path, f"{_line(text, key)}a file of options names no other; remove {key}")
        elif name in known:
            yield name, value
        else:
            _check_known(path, text, key, value, commands)
    for key, value in tables.get(command, {}).items():
        if flag_name(key) not in known or flag_name(key) == CONFIG:
            cure = hint_for(flag_name(key), known) or f"; `{parser.prog} --help` lists them"
            line = _line(text, key, command)
            raise SceneError(path, f"{line}[{command}] {key} is no option of `{parser.prog}`{cure}")
        yield flag_name(key), value


def _check_known(path: Path, text: str, key: str, value: Any, commands: Mapping[str, Any]) -> None:
    """Raise SceneError for a key that is neither an option of any command nor a command's table."""
    everything = {name for make in commands.values() for name in named_actions(make())}
    if flag_name(key) in everything:
        return
    is_table = isinstance(value, dict)
    what = f"[{key}] is no command" if is_table else f"{key} is no option"
    cure = hint_for(flag_name(key), commands if is_table else everything)
    raise SceneError(path, f"{_line(text, key)}{what}{cure or '; `brushgs help` lists commands'}")


def _words(path: Path, parser: ArgumentParser, command: str, options: Mapping[str, Any]) -> list[str]:
    def located(action: Action, text: str) -> str:
        return text if action.dest in OUTPUTS else located_text(text, path.parent)

    try:
        return option_words(parser, options, located)
    except OptionError as error:
        from brushgs.options.toml_values import read_text

        text = read_text(path, "a file of options", MAX_BYTES)
        line = _line(text, error.name, command) or _line(text, error.name)
        raise SceneError(path, f"{line}{error}") from None


def _line(text: str, name: str, table: str = "") -> str:
    from brushgs.options.toml_values import line_of

    return f"line {line}: " if (line := line_of(text, name, table)) else ""


def located_text(text: str, folder: Path) -> str:
    """The text with file names resolved to `folder` if they exist there, also in "painting:a.png"."""

    def one(name: str) -> str:
        is_relative = ("." in name or "/" in name) and not Path(name).is_absolute()
        return str(folder / name) if is_relative and os.path.lexists(folder / name) else name

    if "\0" in text or len(text) > 4096:
        return text
    return found if (found := one(text)) != text else re.sub(r"[^,:\s()]+", lambda match: one(match[0]), text)
