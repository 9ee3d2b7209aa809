"""`brushgs cluster`: merge Gaussians into fewer, larger ones, and write them as a scene."""

from argparse import ArgumentParser, Namespace

from brushgs.cli import flags
from brushgs.cli.clips import open_clip
from brushgs.cli.configs import paint_config, scene_source, where_config
from brushgs.cli.console import output_beside, reported
from brushgs.formats.registry import SCENE_SUFFIXES


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add_scene(parser)
    flags.add_scene_output(parser, "strokes", has_moments=True)
    flags.add_cluster(parser)
    flags.add(parser, "strokes")
    about = "stored with the strokes, so that they get the view of their scene"
    flags.add(parser, "view", "up", group=("view", about))
    about = "of a moving scene; strokes are written at 24 moments per second"
    flags.add(parser, "clip", "start", "end", group=("clip", about))
    flags.add_where(parser, "merge only Gaussians in this part; the others stay as they are")
    flags.add(parser, flags.ReportFlags)
    flags.add(parser, flags.CacheFlag)


def run(args: Namespace) -> None:
    """Write the strokes."""
    config, scene, where = paint_config(args), scene_source(args), where_config(args)
    with reported(args) as report:
        from brushgs.cli.origin import output_of
        from brushgs.outlets.passes import cluster_file

        clip = open_clip(args, scene)
        suffix = SCENE_SUFFIXES[0] if clip is None else ""
        output = output_of(args, output_beside(scene, "strokes", suffix))
        cluster_file(clip or scene, output, config, report, where=where)
