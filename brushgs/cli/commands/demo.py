"""`brushgs demo`: build and paint the example scene, still or moving."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Annotated

from brushgs.cli import flags
from brushgs.cli.configs import paint_config, painting_name
from brushgs.cli.console import reported
from brushgs.options.table import Options, option

BACKGROUND = "#2e2113"  # without a ground: gaps between strokes stay warm and dark


class Own(Options, frozen=True):
    """The options of this command alone."""

    # fmt: off
    output: Annotated[Path, option("folder", flag="-o --output",
        default="brushgs-demo in the current folder", metavar="FOLDER")] = Path("brushgs-demo")
    moving: Annotated[bool, option("build the moving scene instead (4 seconds in 96 files, 140 MB), and "
        "paint a film of it")] = False
    # fmt: on


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add(parser, Own)
    flags.add(parser, flags.NoClobberFlag)
    flags.add_size(parser, "1200x900, of a film 960x720", group=("", ""))
    flags.add(parser, "cluster", "seed", group=("", ""))
    flags.add_stroke_count(parser, has_look=True)
    flags.add_look(parser)
    flags.add_draw(parser, has_look=True)
    flags.add(parser, flags.ReportFlags)


def run(args: Namespace) -> None:
    """Build, write and paint the scene."""
    config = paint_config(args, draw={"background": BACKGROUND})
    with reported(args) as report:
        from brushgs.cli.origin import check_kept, origin_of
        from brushgs.outlets.demo import paint_demo, paint_moving_demo

        check_kept(args, args.output)
        paint = paint_moving_demo if args.moving else paint_demo
        paint(args.output, config, report=report, name=painting_name(args, config), origin=origin_of(args))
