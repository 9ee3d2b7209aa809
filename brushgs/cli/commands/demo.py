"""`brushgs demo`: the example scene, built and painted, or built in motion."""

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
        help="build the scene in motion instead: a folder of scene files, 4 seconds at 30 a second, "
        "177 MB, for `brushgs render`; takes only -o and --seed",
    )
    flags.ConfigFlags(parser, "view").add(
        "--size", type=values.picture_size, metavar="WxH", help="picture size in pixels, default 1200x900"
    )
    flags.add_seed(parser)
    flags.add_stroke_count(parser, has_look=True)
    flags.add_look(parser)
    flags.add_draw(parser, has_look=True)
    flags.add_report(parser)


def run(args: Namespace) -> None:
    """Build, write and paint the scene."""
    if args.moving:
        _build_moving(args)
        return
    config = paint_config(args, draw={"background": BACKGROUND})
    with reported(args) as report:
        from brushgs.painting.demo import paint_demo

        paint_demo(args.output, config, report=report, name=painting_name(args, config))


def _build_moving(args: Namespace) -> None:
    from brushgs.options.painting import STEPS, ClusterConfig

    seed = flags.given(args, "cluster").get("seed", ClusterConfig.seed)
    named = {(step, name) for step in STEPS for name in flags.given(args, step)} - {("cluster", "seed")}
    if named or args.look is not None:
        raise ValueError(
            "--moving builds a scene and paints nothing, so it takes only -o and --seed; give the other "
            "words to `brushgs render`, with the folder that it writes"
        )
    with reported(args) as report:
        from brushgs.painting.demo import build_moving_demo

        build_moving_demo(args.output, seed, report=report)
