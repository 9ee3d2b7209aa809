"""`brushgs view`: a painting in the browser, to be turned, changed, and painted from where one stands."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from brushgs.cli import flags, values
from brushgs.cli.configs import look_of, paint_config, scene_source
from brushgs.cli.console import reported
from brushgs.cli.words import NOT_PAINTED, words_of

if TYPE_CHECKING:
    from brushgs.outlets.studio.session import Session

# Flags that say nothing of what `brushgs render` paints.
OF_THE_VIEWER = {"host", "port", "browser", "headset", "certificate", "private_key"}


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add_scene(parser)
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        default=Path(),
        metavar="FOLDER",
        help="where pictures and videos that are asked for in the page are written, SCENE-LOOK-1.png and so "
        "on; default the current folder",
    )
    group = parser.add_argument_group("server", "of this machine, for its own browser")
    group.add_argument(
        "--port",
        type=values.count_from(0),
        default=0,
        metavar="N",
        help="0 to 65535, default 0: a free one",
    )
    group.add_argument(
        "--host",
        metavar="ADDRESS",
        help="address of this machine that others may use too, 0.0.0.0 for all of them; default 127.0.0.1, "
        "which only this machine reaches",
    )
    group.add_argument(
        "--no-browser", dest="browser", action="store_false", help="print the address, and open no browser"
    )
    group.add_argument(
        "--serve",
        dest="headset",
        action="store_true",
        help="for a headset: print how it reaches the page, and open no browser here",
    )
    group.add_argument(
        "--certificate", type=Path, metavar="FILE", help="of https, in PEM; default none, which is http"
    )
    group.add_argument("--private-key", type=Path, metavar="FILE", help="of the certificate; default none")
    flags.add_painting(parser)
    flags.add_report(parser)


def run(args: Namespace) -> None:
    """Paint, and serve until Ctrl-C."""
    from brushgs.options.viewer import LOOPBACK, ServerConfig

    server = ServerConfig(
        LOOPBACK if args.host is None else args.host, args.port, args.certificate, args.private_key
    )
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
        opens_browser=args.browser and not args.headset,
        is_for_headset=args.headset,
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
    others = {*OF_THE_VIEWER, *NOT_PAINTED, "lod", "time", "moments_per_second", *overrides}
    if overrides.get("palette.file", "") is None:
        others |= {"palette.file", "palette.strength", "palette.space"}
    return words_of(parser, args.words, lambda dest: dest not in others and not dest.startswith("view."))
