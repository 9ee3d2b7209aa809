"""`brushgs view`: a painting in the browser, to be turned, changed, and painted from where one stands."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from brushgs.cli import flags
from brushgs.cli.configs import look_of, paint_config, scene_source
from brushgs.cli.console import reported
from brushgs.cli.words import NOT_PAINTED, words_of
from brushgs.options.table import Options, option, rows_of
from brushgs.options.viewer import ServerConfig

if TYPE_CHECKING:
    from brushgs.outlets.studio.session import Session


class Own(Options, frozen=True):
    """Where pictures go, and which browser looks."""

    # fmt: off
    output: Annotated[Path, option("where pictures and videos that are asked for in the page are written, "
        "SCENE-LOOK-1.png and so on", flag="-o --output", default="the current folder", metavar="FOLDER"
    )] = Path()
    # fmt: on


class Browser(Options, frozen=True):
    """What opens the page."""

    GROUP: ClassVar = ServerConfig.GROUP
    # fmt: off
    no_browser: Annotated[bool, option("print the address, and open no browser")] = False
    serve: Annotated[bool, option("for a headset: print how it reaches the page, and open no browser here"
    )] = False
    # fmt: on


# Flags that say nothing of what `brushgs render` paints.
OF_THE_VIEWER = {row.field for kind in (ServerConfig, Browser) for row in rows_of(kind)}


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add_scene(parser)
    flags.add(parser, Own)
    flags.add(parser, flags.NoMetadataFlag)
    flags.add(parser, ServerConfig)
    flags.add(parser, Browser)
    flags.add_painting(parser)
    flags.add(parser, flags.ReportFlags)


def run(args: Namespace) -> None:
    """Paint, and serve until Ctrl-C."""
    server = ServerConfig(args.host, args.port, args.certificate, args.key)
    paint_config(args)
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
    )


def session_of(args: Namespace) -> "Session":
    """What the command line asks for, ready to be painted."""
    from brushgs.outlets.studio.session import Session

    return Session(
        scene_source(args),
        lambda overrides: paint_config(_with(args, overrides)),
        look_of(args),
        lambda overrides: _words(args, overrides),
        args.output,
        writes_metadata=not args.no_metadata,
    )


def _with(args: Namespace, overrides: Mapping[str, Any]) -> Namespace:
    """The command line with other values; a palette file of None is no palette at all."""
    changed = {**vars(args), **overrides}
    if changed.get("palette.file", "") is None:
        changed = {name: value for name, value in changed.items() if not name.startswith("palette.")}
    return Namespace(**changed)


def _words(args: Namespace, overrides: Mapping[str, Any]) -> list[str]:
    """The words of the command line that decide what is painted, without those that are overridden."""
    parser = ArgumentParser()
    add_flags(parser)
    others = {*OF_THE_VIEWER, *NOT_PAINTED, *overrides}
    if overrides.get("palette.file", "") is None:
        others |= {"palette.file", "palette.strength", "palette.space"}
    return words_of(
        parser, args.words, lambda dest: dest not in others and not dest.startswith(("view.", "source."))
    )
