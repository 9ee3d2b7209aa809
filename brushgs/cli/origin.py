"""Output paths and metadata of pictures; default names never replace another file.

A default name is numbered where a file lies there, but for a picture whose metadata say that it is the same
painting, see `formats.pictures.metadata`. A name that was given (-o) is written to, unless --no-clobber.
"""

import shlex
from argparse import SUPPRESS, Action, Namespace, _AppendAction
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from brushgs.cli.parser import command_parser
from brushgs.cli.words import NOT_PAINTED, pieces_of
from brushgs.errors import SceneError
from brushgs.values.shot import without_folders

if TYPE_CHECKING:
    from brushgs.values.shot import Origin

# `dest` of flags that do not change the picture.
NOT_RECORDED = NOT_PAINTED | {"views", "explain", "sheet"}
NOT_RECORDED |= {f"sequence.{field}" for field in ("is_resumed", "jobs", "scheduler", "workers_timeout")}


def command_of(args: Namespace) -> str:
    """The command line for metadata: files without folders, flags in help order, defaults left out."""
    command, *words = args.words
    parser = command_parser(command)
    arguments: list[str] = []
    given: dict[Action, list[str]] = {}
    for action, values in pieces_of(parser, words):
        names = [without_folders(value) for value in values]
        if action is None:
            arguments += names
        elif action.dest not in NOT_RECORDED and (
            action.default is SUPPRESS or names != [str(action.default)]
        ):
            given[action] = [*given.get(action, []), *names] if isinstance(action, _AppendAction) else names
    flags: list[str] = []
    for action in parser._actions:
        if action in given:
            name, values = action.option_strings[-1], given[action]
            one_each = isinstance(action, _AppendAction) or any(value.startswith("-") for value in values)
            flags += [f"{name}={value}" for value in values] if one_each else [name, *values]
    return shlex.join(["brushgs", command, *arguments, *flags])


def origin_of(args: Namespace, inputs: Iterable[Path] = ()) -> "Origin":
    """How what a command paints comes about; `inputs` are the files that it reads, or names of none."""
    from brushgs.pipeline.outputs import digest_of
    from brushgs.values.shot import Origin

    return Origin(command_of(args), digest_of(inputs))


def output_of(
    args: Namespace,
    default: Path,
    origin: "Origin | None" = None,
    is_ours: Callable[[Path], bool] | None = None,
) -> Path:
    """The output path: `args.output`, or the default name, numbered if it exists.

    Args:
        args: parsed flags, with `no_clobber`.
        default: default name; without a suffix it is a folder.
        origin: of the picture; None for a file without metadata.
        is_ours: decides whether a file may be replaced, instead of its origin.

    Raises:
        SceneError: if the given file exists and --no-clobber is set.
    """
    named = args.output if "output" in args else args.report
    if named:
        check_kept(args, named)
        return named  # type: ignore[no-any-return]
    from brushgs.pipeline.outputs import free_name

    return free_name(default, None if args.no_clobber else origin, is_ours)


def check_kept(args: Namespace, name: Path | str | None) -> None:
    """Raise SceneError if --no-clobber is given and the file exists."""
    if not args.no_clobber or name is None:
        return
    path = Path(name)
    if "%" in path.name:
        from brushgs.formats.pictures.numbered import NumberedFiles
        from brushgs.formats.registry import PICTURE_SUFFIXES

        is_taken = bool(NumberedFiles.of(path, PICTURE_SUFFIXES).numbers())
    else:
        from brushgs.pipeline.outputs import is_there

        is_taken = is_there(path)
    if is_taken:
        raise SceneError(path, "exists, and --no-clobber replaces no file; choose another name")
