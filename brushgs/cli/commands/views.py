"""`brushgs views`: a sheet with views of a scene from all around, each with its flags."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Annotated

from brushgs.cli import flags
from brushgs.cli.configs import paint_config, scene_source
from brushgs.cli.console import output_beside, reported
from brushgs.formats.registry import PICTURE_SUFFIXES
from brushgs.options.table import Options, option


class Own(Options, frozen=True):
    """The options of this command alone."""

    # fmt: off
    output: Annotated[Path | None, option("picture, {written}", flag="-o --output", default=
        f"SCENE-views{PICTURE_SUFFIXES[0]} in the current folder")] = None
    # fmt: on


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    group = ("view", "the same in all pictures")
    flags.add_scene(parser)
    flags.add(parser, Own)
    flags.add(parser, flags.NoClobberFlag)
    flags.add(parser, flags.NoMetadataFlag)
    flags.add_size(parser, "256x192", group=group)
    flags.add(parser, "view", "up", "look_at", "distance", "pan", "roll", "fov_y", "zoom", group=group)
    flags.add_no_cameras(parser, group)
    flags.add(parser, "clean", group=group)
    flags.add(parser, "draw", "threads", group=("", ""))
    flags.add(parser, flags.ReportFlags)


def run(args: Namespace) -> None:
    """Write the sheet."""
    config, scene = paint_config(args), scene_source(args)
    from brushgs.cli.origin import origin_of, output_of
    from brushgs.pipeline.outputs import scene_inputs
    from brushgs.pipeline.views_sheet import ViewsReport, paint_views

    report = ViewsReport()
    with reported(args, report):
        origin = None if args.no_metadata else origin_of(args, scene_inputs(scene))
        output = output_of(args, output_beside(scene, "views", PICTURE_SUFFIXES[0]), origin)
        paint_views(scene, output, config, report=report, origin=origin)
