"""`brushgs export`: a scene becomes one HTML file, in which the painting can be turned."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from brushgs.cli import flags
from brushgs.cli.configs import paint_config, painting_name, scene_source
from brushgs.cli.console import output_beside, reported
from brushgs.cli.words import NOT_PAINTED, words_of
from brushgs.options.page import PAGE_SUFFIXES


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add_scene(parser)
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help=f"page ({', '.join(PAGE_SUFFIXES)}), default SCENE-LOOK{PAGE_SUFFIXES[0]} in the current "
        f"folder, SCENE-STROKE{PAGE_SUFFIXES[0]} where a stroke is named",
    )
    parser.add_argument("--title", metavar="TEXT", help="of the page, default the name of the scene")
    flags.add_painting(parser)
    flags.add_report(parser)


def run(args: Namespace) -> None:
    """Write the page, and report the stages."""
    config, scene = paint_config(args), scene_source(args)
    output = args.output or output_beside(scene, painting_name(args, config), PAGE_SUFFIXES[0])
    parser = ArgumentParser()
    add_flags(parser)
    options = words_of(parser, args.words, _paints)
    with reported(args) as report:
        from brushgs.page.export import export_file

        export_file(scene, output, config, title=args.title, options=options, report=report)


def _paints(dest: str) -> bool:
    """Whether a flag decides what is painted, and not from where; level of detail and moment go with it."""
    return dest not in NOT_PAINTED and dest not in ("title", "lod", "time") and not dest.startswith("view.")
