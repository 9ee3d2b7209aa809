"""`brushgs completion`: print a shell's completion script for commands, flags and values."""

import sys
from argparse import ArgumentParser, Namespace, RawDescriptionHelpFormatter, _SubParsersAction
from typing import Annotated

from brushgs.cli import flags
from brushgs.options.table import Options, option

SHELLS = ("bash", "zsh", "fish", "tcsh")  # supported by shtab
FILE_TYPES = ("FILE", "FOLDER", "PATH", "SCENE")  # words of a metavar that stand for files
EPILOG = """\
once, for each user:
  brushgs completion bash > ~/.local/share/bash-completion/completions/brushgs
  brushgs completion zsh > ~/.zfunc/_brushgs        # a folder of $fpath
  brushgs completion fish > ~/.config/fish/completions/brushgs.fish
  brushgs completion tcsh > ~/.brushgs.tcsh         # and `source ~/.brushgs.tcsh` in ~/.tcshrc

The script starts no program: print it again after an update."""


class Own(Options, frozen=True):
    """The options of this command alone."""

    # fmt: off
    shell: Annotated[str, option("shell to complete in (extra completion)", flag="shell", default="",
        metavar="|".join(SHELLS), choices=SHELLS)]
    # fmt: on


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    parser.formatter_class = RawDescriptionHelpFormatter
    parser.epilog = EPILOG
    flags.add(parser, Own)


def run(args: Namespace) -> None:
    """Print the script.

    Raises:
        ValueError: if shtab is not installed.
    """
    try:
        import shtab
    except ImportError:
        raise ValueError(
            "completion needs shtab, which is not installed; pip install 'brushgs[completion]'"
        ) from None
    from brushgs.cli.parser import COMMANDS, build_parser

    parser = build_parser(list(COMMANDS))
    _complete_files(parser, shtab.FILE)
    sys.stdout.write(shtab.complete(parser, args.shell) + "\n")


def _complete_files(parser: ArgumentParser, how: object) -> None:
    """Mark arguments that name files, in all commands."""
    for action in parser._actions:
        if isinstance(action, _SubParsersAction):
            for command in action.choices.values():
                _complete_files(command, how)
            continue
        row = flags.row_of_action(action)
        names_files = (
            row is None or row.names_files or any(word in str(action.metavar) for word in FILE_TYPES)
        )
        if names_files and action.nargs != 0:
            action.complete = how  # type: ignore[attr-defined]  # where shtab looks for it
