"""`brushgs prune`: keep the most important Gaussians, and write them as a scene."""

from argparse import ArgumentParser, Namespace

from brushgs.cli import flags
from brushgs.cli.configs import paint_config, scene_source, where_config
from brushgs.cli.console import output_beside, reported
from brushgs.formats.registry import SCENE_SUFFIXES


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add_scene(parser)
    flags.add_scene_output(parser, "pruned")
    flags.add(parser, "prune")
    flags.add_where(parser, "drop Gaussians only in this part")
    flags.add(parser, flags.ReportFlags)
    flags.add(parser, flags.CacheFlag)


def run(args: Namespace) -> None:
    """Write the pruned scene."""
    config, scene, where = paint_config(args).prune, scene_source(args), where_config(args)
    with reported(args) as report:
        from brushgs.cli.origin import output_of
        from brushgs.outlets.passes import prune_file

        output = output_of(args, output_beside(scene, "pruned", SCENE_SUFFIXES[0]))
        prune_file(scene, output, config, report, where=where)
