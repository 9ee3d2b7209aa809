"""`brushgs bench`: error against run time on one scene, in figures and a plot.

Without a look, bare strokes are measured, so that curves stay comparable over versions.
"""

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING, Annotated, Any

from brushgs.cli import flags
from brushgs.cli.configs import look_of, paint_config, scene_source
from brushgs.cli.console import output_beside, reported
from brushgs.options.choices import PLAIN_LOOK
from brushgs.options.experiments import BenchConfig
from brushgs.options.table import Options, option

if TYPE_CHECKING:
    from brushgs.options.painting import PaintConfig

QUICK_SIZE = (640, 360)  # pixels


class Own(Options, frozen=True):
    """The options of this command alone."""

    # fmt: off
    quick: Annotated[bool, option("fewer counts and repeats at 640x360: under a minute on 100,000 Gaussians "
        "and two processors")] = False
    # fmt: on


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add_scene(parser)
    flags.add_experiment_output(parser, "bench")
    flags.add(parser, Own)
    flags.add(parser, "bench")
    flags.add_look(parser, usual=PLAIN_LOOK)
    flags.add_draw(parser, has_look=True)
    flags.add(parser, "prune")
    flags.add(parser, "clean")
    flags.add(parser, "cluster", without=("strokes",))
    flags.add_passes(parser)
    flags.add_view(parser, size="1280x720, with a look auto, and 640x360 with --quick")
    flags.add(parser, flags.ReportFlags)
    flags.add(parser, flags.CacheFlag)


def run(args: Namespace) -> None:
    """Measure, and write the report."""
    (paint, config), scene = configs(args), scene_source(args)
    from brushgs.cli.origin import output_of
    from brushgs.measure.bench import BenchReport, report_bench

    report = BenchReport()
    with reported(args, report):
        output = output_of(args, output_beside(scene, "bench", ""))
        report_bench(scene, output, paint, config, report=report, wants_plot=not args.no_plot)


def configs(args: Namespace) -> "tuple[PaintConfig, BenchConfig]":
    """The options of painting and of measurement; stroke counts are only in the latter.

    Raises:
        ValueError: if a value is out of range, or flags exclude each other.
    """
    from msgspec.structs import replace

    view: dict[str, Any] = {}
    if look_of(args) != PLAIN_LOOK:
        view["size"] = "auto"  # as `render` paints
    if args.quick and "camera_file" not in flags.given(args, "view"):
        view["size"] = QUICK_SIZE
    paint = paint_config(args, view=view)
    config = BenchConfig.quick() if args.quick else BenchConfig()
    return paint, replace(config, **flags.given(args, "bench"))
