"""`brushgs recolor`: write a scene in the colors of a picture."""

from argparse import ArgumentParser, Namespace

from brushgs.cli import flags
from brushgs.cli.configs import paint_config, scene_source, where_config
from brushgs.cli.console import output_beside, reported
from brushgs.formats.registry import SCENE_SUFFIXES


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add_scene(parser)
    flags.add_scene_output(parser, "recolored")
    flags.add(parser, "palette", required=True)
    flags.add_where(parser, "change colors only in this part")
    flags.add(parser, flags.ReportFlags)
    flags.add(parser, flags.CacheFlag)


def run(args: Namespace) -> None:
    """Write the recolored scene."""
    config, scene, where = paint_config(args).palette, scene_source(args), where_config(args)
    assert config is not None, "the parser requires --palette"
    with reported(args) as report:
        from brushgs.cli.origin import output_of
        from brushgs.outlets.passes import recolor_file

        output = output_of(args, output_beside(scene, "recolored", SCENE_SUFFIXES[0]))
        recolor_file(scene, output, config, report, where=where)
