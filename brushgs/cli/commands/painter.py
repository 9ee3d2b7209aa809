"""`brushgs painter`: write the page that paints scene files dropped on it."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Annotated

from brushgs.cli import flags
from brushgs.options.table import Options, option


class Own(Options, frozen=True):
    """The options of this command alone."""

    # fmt: off
    output: Annotated[Path, option("HTML file", flag="-o --output",
        default="painter.html in the current folder", metavar="FILE")] = Path("painter.html")
    # fmt: on


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add(parser, Own)
    flags.add(parser, flags.NoClobberFlag)


def run(args: Namespace) -> None:
    """Write the page, and print its path."""
    from brushgs.cli.origin import check_kept
    from brushgs.outlets.painter.page import write_painter

    check_kept(args, args.output)
    write_painter(args.output)
    print(args.output)
