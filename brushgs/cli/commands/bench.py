"""`brushgs bench`: error against run time on one scene, in figures and a plot.

Bare strokes are measured unless a look is named, so that old curves and new ones compare.
"""

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING, Any, get_args

from brushgs.cli import flags, values
from brushgs.cli.configs import look_of, paint_config, scene_source
from brushgs.cli.console import output_beside, reported
from brushgs.options.choices import PLAIN_LOOK, BenchFamily

if TYPE_CHECKING:
    from brushgs.options.experiments import BenchConfig
    from brushgs.options.painting import PaintConfig

QUICK_SIZE = (640, 360)  # pixels


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add_scene(parser)
    flags.add_experiment_output(parser, "bench")
    parser.add_argument(
        "--quick",
        action="store_true",
        help="fewer counts and repeats at 640x360: under a minute on 100,000 Gaussians and two processors",
    )
    bench = flags.ConfigFlags(parser, "bench")
    bench.add(
        "--families",
        type=values.words,
        metavar="NAME,...",
        help=f"curves to measure, of {', '.join(get_args(BenchFamily))}; default all that apply to the "
        "scene, with a look strokes, size, views and knobs, against the painting itself at its limit",
    )
    bench.add(
        "--strokes",
        type=values.counts,
        metavar="N,...",
        help="stroke counts of the first curve, ascending, each 1 or more; default 125 to 64000 by doubling; "
        "one per Gaussian that is kept is always the last",
    )
    bench.add(
        "--repeats",
        type=values.count_from(1),
        metavar="N",
        help="rounds in which every point is measured, 1 or more, default 5 (3 with --quick)",
    )
    flags.add_look(parser, usual=PLAIN_LOOK)
    flags.add_draw(parser, has_look=True)
    flags.add_prune(parser)
    group = parser.add_argument_group("clustering")
    flags.add_clean(group)
    flags.add_merging(group)
    flags.add_strokes_for(group)
    flags.add_stroke_passes(parser)
    flags.add_palette(parser)
    flags.add_style(parser)
    flags.add_rules(parser)
    flags.add_where(
        parser, "what is painted; the rest is shown as it is", has_camera_file=True, step="painted"
    )
    flags.add_view(parser, size="1280x720, with a look auto, and 640x360 with --quick")
    flags.add_report(parser)


def run(args: Namespace) -> None:
    """Measure, and write the report."""
    (paint, config), scene = configs(args), scene_source(args)
    from brushgs.measure.bench import BenchReport, report_bench

    report = BenchReport()
    output = args.report or output_beside(scene, "bench", "")
    with reported(args, report):
        report_bench(scene, output, paint, config, report=report, wants_plot=not args.no_plot)


def configs(args: Namespace) -> "tuple[PaintConfig, BenchConfig]":
    """What is painted, and what is measured; the stroke counts are in the latter only.

    Raises:
        ValueError: if a value is out of range, or flags exclude each other.
    """
    from dataclasses import replace

    from brushgs.options.experiments import BenchConfig

    view: dict[str, Any] = {}
    if look_of(args) != PLAIN_LOOK:
        view["size"] = "auto"  # the picture that `render` paints
    if args.quick and "camera_file" not in flags.given(args, "view"):
        view["size"] = QUICK_SIZE
    paint = paint_config(args, view=view)
    config = BenchConfig.quick() if args.quick else BenchConfig()
    return paint, replace(config, **flags.given(args, "bench"))
