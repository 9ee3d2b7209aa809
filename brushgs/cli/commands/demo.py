"""`brushgs demo`: the example scene, still or in motion, built and painted."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from brushgs.cli import flags, values
from brushgs.cli.configs import paint_config, painting_name
from brushgs.cli.console import reported

BACKGROUND = "#2e2113"  # where a look has no ground: what strokes leave open stays warm and dark


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        default=Path("brushgs-demo"),
        metavar="FOLDER",
        help="folder, default brushgs-demo in the current folder",
    )
    parser.add_argument(
        "--moving",
        action="store_true",
        help="build the scene in motion instead, 4 seconds in a folder of 96 files (140 MB), and paint a "
        "film of it",
    )
    flags.ConfigFlags(parser, "view").add(
        "--size",
        type=values.picture_size,
        metavar="WxH",
        help="size in pixels, default 1200x900, of a film 960x720",
    )
    flags.add_seed(parser)
    flags.add_stroke_count(parser, has_look=True)
    flags.add_look(parser)
    flags.add_draw(parser, has_look=True)
    flags.add_report(parser)


def run(args: Namespace) -> None:
    """Build, write and paint the scene."""
    config = paint_config(args, draw={"background": BACKGROUND})
    with reported(args) as report:
        from brushgs.outlets.demo import paint_demo, paint_moving_demo

        paint = paint_moving_demo if args.moving else paint_demo
        paint(args.output, config, report=report, name=painting_name(args, config))
