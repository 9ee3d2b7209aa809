"""`brushgs views`: a scene from all around on one sheet, each picture with the flags that give it."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from brushgs.cli import flags, values
from brushgs.cli.configs import paint_config, scene_source
from brushgs.cli.console import output_beside, reported
from brushgs.io.pictures.formats import PICTURE_SUFFIXES, PICTURES_WRITTEN


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add_scene(parser)
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help=f"picture, {PICTURES_WRITTEN}; default SCENE-views{PICTURE_SUFFIXES[0]} in the current folder",
    )
    group = parser.add_argument_group("view", "the same in all pictures")
    flags.ConfigFlags(group, "view").add(
        "--size",
        type=values.picture_size,
        metavar="WxH",
        help="size of one picture in pixels, default 256x192",
    )
    flags.add_up(group)
    flags.add_aim(group)
    flags.add_no_cameras(group)
    flags.add_clean(group)
    flags.add_threads(parser)
    flags.add_report(parser)


def run(args: Namespace) -> None:
    """Write the sheet."""
    config, scene = paint_config(args), scene_source(args)
    output = args.output or output_beside(scene, "views", PICTURE_SUFFIXES[0])
    from brushgs.pipeline.views_sheet import ViewsReport, paint_views

    report = ViewsReport()
    with reported(args, report):
        paint_views(scene, output, config, report=report)
