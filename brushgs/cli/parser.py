"""The parser of the command line and the table of commands.

Only the module of the given command is imported, without heavy modules: `brushgs --help` takes little longer
than starting Python.
"""

import os
import re
import sys
import textwrap
from argparse import SUPPRESS, Action, ArgumentParser, Namespace, RawDescriptionHelpFormatter, _HelpAction
from collections.abc import Iterator, Sequence
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

from brushgs.cli.config_file import add_config
from brushgs.cli.flags import row_of_action
from brushgs.formats.registry import SCENE_SUFFIXES
from brushgs.options.renamed import current_words
from brushgs.options.table import Row, hint_for
from brushgs.version import __version__

COMMANDS = {  # module in brushgs.cli.commands -> description
    "render": "paint a scene as a picture; along a camera path or of a moving scene, as frames or a video",
    "export": "write a painted scene as one HTML file to turn in a browser, as a 3D model, or as strokes",
    "adopt": "make marks in space of what was painted over a picture of a scene",
    "batch": "run many jobs from one file: scenes, looks and views",
    "view": "paint a scene in the browser: turn it, change it, and paint pictures and videos from there",
    "painter": "write one HTML file that paints scene files dropped on it, without brushgs",
    "demo": "build the example scene and paint it",
    "prune": "keep the most important Gaussians: scene in, scene out",
    "cluster": "merge Gaussians into fewer, larger ones: scene in, scene out",
    "recolor": "give a scene the colors of a picture: scene and picture in, scene out",
    "refine": "fit strokes to the scene, or to a style image: scene in, scene out",
    "style": "learn a style from a painting or an edit, or show a style file",
    "views": "write a sheet with views of a scene from all around, each with its flags",
    "stability": "measure how stable the strokes are along a camera path, or as a scene moves",
    "bench": "measure error against run time on a scene, as curves",
    "compare": "measure how near paintings are to the scene, to each other and to a style image",
    "doctor": "find faults and oddities in a scene file, and fix them",
    "strokes": "list the built-in strokes and what each is good for, or draw a chart of them",
    "looks": "list the looks and what each is good for, print one to change, or draw a chart of them",
    "info": "describe a scene file, or how a picture was painted",
    "cache": "show the results that commands keep on disk, or remove them",
    "completion": "print a shell's completion script for commands and flags",
}

EXAMPLES = {"scene": "scene.ply", "JOBS": "jobs.toml"}  # arguments for messages
DESCRIPTION = "Paint trained 3D Gaussian Splatting scenes with brush strokes, on the CPU."
EPILOG = """\
examples:
  brushgs demo                                        an example scene, painted
  brushgs render scene.ply                            any trained 3DGS scene, in oil
  brushgs render scene.ply --look charcoal            in another look; `brushgs looks` lists them
  brushgs render scene.ply --stroke gaussian          the plain 3DGS picture
  brushgs render scene.ply --stroke my_brush.png --strokes 2000 --size 1920x1080
  brushgs render scene.ply --orbit 120 -o turn.mp4    one turn around the scene, as a video
  brushgs render clip.splatv                          a moving scene, as a video
  brushgs export scene.ply                            an HTML page in which the painting can be turned
  brushgs batch jobs.toml                             many scenes, looks and views
  brushgs render scene.ply --config mine.toml         options from a file, by the names of flags

`brushgs help COMMAND` lists the flags of a command. A command prints the path of its output on stdout and a
table of its stages on stderr. Exit codes: 0 success, 1 internal error, 2 unusable input (one sentence on
stderr), 3 fault found by doctor, 130 stopped with Ctrl-C, 143 with SIGTERM."""


class UsageError(ValueError):
    """A command line that cannot be parsed."""


class _Parser(ArgumentParser):
    """A parser without abbreviated flags, see `brushgs.cli.unknown_flags`."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **{"allow_abbrev": False, "add_help": False} | options)

    def error(self, message: str) -> NoReturn:
        message = re.sub(r"^argument (\S+?)(/\S+)?: (?=must )", r"\1 ", message).removeprefix("argument ")
        message = message.replace(": not allowed with argument ", " cannot be combined with ")
        if wrong := re.match(r"COMMAND: invalid choice: '(.*?)' \(", message):
            cure = hint_for(wrong[1], COMMANDS) or "; `brushgs help` lists commands"
            message = f"{wrong[1][:80]!r} is no command, and no file{cure}"
        if missing := re.fullmatch(r"the following arguments are required: (.*)", message):
            example = EXAMPLES.get(missing[1].split(",")[0])
            cure = f", as in `{self.prog} {example}`" if example else ""
            message = f"{missing[1]} is missing; name it{cure}"
        raise UsageError(f"{message} (see {self.prog} --help)")


def parse(words: Sequence[str]) -> Namespace:
    """Parse a command line; the namespace also has `run`, the function of the command, and `words`.

    Raises:
        UsageError: if a flag or value is invalid; one sentence.
    """
    if len(words) > 1 and words[0] == "help" and words[1] not in COMMANDS:
        print(found_by(command_parser("render"), words[1:]))
        raise SystemExit(0)
    words, notes = current_words(_joined(_with_command(_asking_for_help(words))))
    expanded = _configured(words)
    try:
        args = build_parser(words).parse_args(expanded)
    except UsageError as error:
        sentence = str(error)
        if expanded[0] in COMMANDS or expanded[0].startswith("-"):
            from brushgs.cli.unknown_flags import with_nearest_flag

            sentence = with_nearest_flag(sentence, expanded, _all_flags(expanded[0]))
        if expanded != words:
            sentence += "; some options are those of --config"
        raise UsageError(sentence) from None
    args.words = expanded
    if not getattr(args, "quiet", False):
        for note in notes:
            print(f"brushgs: note: {note}", file=sys.stderr)
    return args


def _all_flags(command: str) -> list[str]:
    """The flags of a command; of the program for an unknown one."""
    parser = command_parser(command) if command in COMMANDS else build_parser([])
    return [flag for action in parser._actions for flag in action.option_strings]


def _configured(words: list[str]) -> list[str]:
    """The words with those of the --config file added."""
    if words[0] not in COMMANDS or not any(word.partition("=")[0] == "--config" for word in words):
        return words
    from brushgs.cli.config_file import with_config

    makers = {name: partial(command_parser, name) for name in COMMANDS}
    return with_config(command_parser(words[0]), makers, words)


def build_parser(words: Sequence[str]) -> ArgumentParser:
    """The parser of all commands, made once; only commands in `words` have flags."""
    return _parsers(tuple(name for name in COMMANDS if name in words))[0]


def command_parser(name: str) -> ArgumentParser:
    """The parser of one command, made once, for its arguments without the name."""
    return _parsers((name,))[1][name]


@cache  # 4 ms for `render`: a batch, or a program, runs many commands
def _parsers(names: tuple[str, ...]) -> tuple[ArgumentParser, dict[str, ArgumentParser]]:
    """The parser of all commands, and the parser of each; only those of `names` have flags."""
    parser = _Parser(
        "brushgs", description=DESCRIPTION, epilog=EPILOG, formatter_class=RawDescriptionHelpFormatter
    )
    add_help(parser, has_short=False)
    parser.add_argument("--version", action="version", version=f"brushgs {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    made: dict[str, ArgumentParser] = {}
    for name, help in COMMANDS.items():
        made[name] = commands.add_parser(name, help=help, description=f"{help[0].upper()}{help[1:]}.")
        if name in names:
            _add_flags(made[name], name)
    return parser, made


def _add_flags(command: ArgumentParser, name: str) -> None:
    module = import_module(f"brushgs.cli.commands.{name}")
    add_help(command)
    module.add_flags(command)
    command.add_argument("--debug", action="store_true", help="show the traceback of an error")
    add_config(command)
    command.set_defaults(run=module.run)


def _asking_for_help(words: Sequence[str]) -> Sequence[str]:
    """Turn no words, `help` and `help COMMAND` into `--help` and `COMMAND --help`."""
    if not words:
        return ["--help"]
    return [*words[1:2], "--help"] if words[0] == "help" else words


def _with_command(words: Sequence[str]) -> Sequence[str]:
    """Turn `brushgs scene.ply` into `brushgs render scene.ply`: the first word is a file, not a command."""
    if words[0] in COMMANDS or words[0].startswith("-"):
        return words
    is_file = os.path.lexists(words[0]) if "\0" not in words[0] else False
    return ["render", *words] if is_file or Path(words[0]).suffix.lower() in SCENE_SUFFIXES else words


def _joined(words: Sequence[str]) -> list[str]:
    """Turn `--up -y` into `--up=-y`, `--pan -1,0` into `--pan=-1,0`: argparse would take the values for
    flags.
    """
    from brushgs.cli.flags import CLASSES
    from brushgs.options.table import rows_of

    rows = (row for kinds in CLASSES.values() for kind in kinds for row in rows_of(kind))
    signed = {row.flags[-1] for row in rows if row.option.is_signed}
    joined: list[str] = []
    for word in words:
        flag = joined[-1] if joined else ""
        if flag in signed and re.match(r"-([xyz]$|[0-9.])", word, re.IGNORECASE):
            joined[-1] = f"{flag}={word}"
        else:
            joined.append(word)
    return joined


# Help: the main options with examples, one group of options, and a search for options.


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
