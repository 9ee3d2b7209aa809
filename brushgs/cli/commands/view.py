"""`brushgs view`: turn and change a painting in the browser, and paint pictures and videos from there."""

import sys
import tempfile
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from brushgs.cli import flags
from brushgs.cli.clips import open_clip
from brushgs.cli.configs import look_of, paint_config, scene_source
from brushgs.cli.console import reported
from brushgs.cli.words import NOT_PAINTED, pieces_of, words_of
from brushgs.errors import SceneError
from brushgs.options.table import Options, option, rows_of
from brushgs.options.viewer import ServerConfig

if TYPE_CHECKING:
    from brushgs.outlets.studio.saved import SavedOptions
    from brushgs.outlets.studio.session import Session


class Own(Options, frozen=True):
    """The output folder, the file of options, and the moment of a clip."""

    # fmt: off
    output: Annotated[Path, option("folder for pictures and videos requested in the page, SCENE-LOOK-1.png "
        "and so on", flag="-o --output", default="the current folder", metavar="FOLDER"
    )] = Path()
    save: Annotated[Path | None, option("TOML file of all options, for --config, written anew at each change "
        "in the page, with the pictures that were dropped beside it", metavar="FILE", default="none"
    )] = None
    moment: Annotated[float, option("moment of a clip that the page shows first; --save keeps the one where "
        "the page rests", ge=0, unit="seconds")] = 0.0
    # fmt: on


class Scene(Options, frozen=True):
    """The scene, which may be missing, and those that the page offers."""

    # fmt: off
    scene: Annotated[tuple[Path, ...], option("scene, as `brushgs render` takes it; without one the first of "
        "--scenes, or an example; others can be dropped on the page", flag="scene", read=Path, nargs="*",
        default=""
    )] = ()
    scenes: Annotated[Path | None, option("folder of scenes that the page offers to open", metavar="FOLDER",
        default="none"
    )] = None
    # fmt: on


class Browser(Options, frozen=True):
    """How the page is opened."""

    GROUP: ClassVar = ServerConfig.GROUP
    # fmt: off
    no_browser: Annotated[bool, option("print the address, and do not open a browser")] = False
    serve: Annotated[bool, option("for a headset: print how to reach the page from it, and do not open a "
        "browser here"
    )] = False
    # fmt: on


# Flags that `brushgs render` does not have.
OF_THE_VIEWER = {row.field for kind in (Own, Scene, ServerConfig, Browser) for row in rows_of(kind)}


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add(parser, Scene)
    flags.add(parser, "source", without=("memory",))
    flags.add(parser, Own)
    flags.add(parser, flags.NoMetadataFlag)
    flags.add(parser, ServerConfig)
    flags.add(parser, Browser)
    flags.add_painting(parser)
    flags.add(parser, flags.ReportFlags)
    flags.add(parser, flags.CacheFlag)


def run(args: Namespace) -> None:
    """Paint, and serve until Ctrl-C."""
    server = ServerConfig(args.host, args.port, args.certificate, args.key)
    paint_config(args)
    with ExitStack() as stack:
        others = [] if args.scenes is None else scenes_in(args.scenes)
        args.scene = args.scene or others[:1] or [example_in(stack)]
        _serve(args, server, others)


def scenes_in(folder: Path) -> list[Path]:
    """The scenes of a folder. Raises SceneError if it holds none."""
    from brushgs.formats.scenes.open_file import find_parts

    return find_parts([folder])


def example_in(stack: ExitStack) -> Path:
    """The file of an example scene, in a folder that lasts as long as the stack."""
    from brushgs.formats.scenes.write import write_scene
    from brushgs.outlets.demo import SCENE_NAME
    from brushgs.still_life import still_life

    path = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="brushgs-"))) / SCENE_NAME
    write_scene(still_life(), path)
    return path


def _serve(args: Namespace, server: ServerConfig, others: Sequence[Path]) -> None:
    with reported(args) as report:
        from brushgs.outlets.studio.serve import paint_first, serve

        session = session_of(args)
        first = paint_first(session, report)

    def note(text: str) -> None:
        if not args.quiet:
            print(f"brushgs: note: {text}", file=sys.stderr, flush=True)

    serve(
        session,
        first,
        server,
        say=lambda text: print(text, flush=True),
        note=note,
        opens_browser=not args.no_browser and not args.serve,
        is_for_headset=args.serve,
        others=others,
    )


def session_of(args: Namespace) -> "Session":
    """The studio session for a command line."""
    from brushgs.outlets.studio.session import Session
    from brushgs.pipeline.kept import lasting_memory
    from brushgs.pipeline.runner import Memory

    return Session(
        scene_source(args),
        lambda overrides: paint_config(_with(args, overrides)),
        look_of(args),
        lambda overrides: _words(args, overrides),
        args.output,
        writes_metadata=not args.no_metadata,
        saved=saved_options(args),
        moment=args.moment,
        clip_of=lambda source: open_clip(args, source),
        marks=vars(args).get("overpaint.files") or (),
        new_memory=Memory if args.no_cache else lasting_memory,
    )


def saved_options(args: Namespace) -> "SavedOptions | None":
    """The file of --save; None without that flag.

    Raises:
        ValueError: if it has another suffix than .toml.
        SceneError: if it exists and is not the file of --config, or its folder cannot be written to.
    """
    if args.save is None:
        return None
    from brushgs.outlets.studio.saved import SavedOptions
    from brushgs.pipeline.outputs import check_folder

    if args.save.suffix != ".toml":
        raise ValueError(f"save must name a .toml file, got {args.save.name!r}")
    is_own = args.config is not None and args.config.resolve() == args.save.resolve()
    if args.save.exists() and not is_own:
        cure = f"add --config {args.save} to go on with it, or choose another name"
        raise SceneError(args.save, f"exists; {cure}")
    check_folder(args.save.resolve().parent, args.save)
    return SavedOptions(args.save, lambda overrides, flags: _named(args, overrides, flags))


def _with(args: Namespace, overrides: Mapping[str, Any]) -> Namespace:
    """The namespace with overridden values; None removes one, and with a palette file its other options."""
    changed = {**vars(args), **overrides}
    removed = {name for name in overrides if overrides[name] is None}
    if "palette.file" in removed:
        removed |= {name for name in changed if name.startswith("palette.")}
    return Namespace(**{name: value for name, value in changed.items() if name not in removed})


def _named(
    args: Namespace, overrides: Mapping[str, Any], flags: Sequence[str]
) -> list[tuple[str, str | None]]:
    """Names and values (None for a switch) of `flags` and of options that are not overridden."""
    words = _words(args, overrides, without=()) + list(flags)
    pieces = pieces_of(_parser(), words)
    return [(str(one.name), one.values[0] if one.values else None) for one in pieces]


def _parser() -> ArgumentParser:
    parser = ArgumentParser()
    add_flags(parser)
    return parser


def _words(
    args: Namespace, overrides: Mapping[str, Any], without: tuple[str, ...] = ("view.", "source.")
) -> list[str]:
    """The command-line words that change the painting, without overridden ones and those of `without`."""
    others = {*OF_THE_VIEWER, *NOT_PAINTED, *overrides}
    if overrides.get("palette.file", "") is None:
        others |= {"palette.file", "palette.strength", "palette.space"}
    return words_of(_parser(), args.words, lambda dest: dest not in others and not dest.startswith(without))
