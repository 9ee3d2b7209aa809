"""`brushgs refine`: strokes fitted to the plain picture of their scene, or to a style image."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from brushgs.cli import flags, values
from brushgs.cli.clips import open_clip
from brushgs.cli.configs import paint_config, scene_source, where_config
from brushgs.cli.console import output_beside, reported
from brushgs.io.scenes.formats import SCENE_SUFFIXES
from brushgs.options.choices import Params

if TYPE_CHECKING:
    from brushgs.options.experiments import RefineConfig


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add_scene(parser)
    flags.add_scene_output(parser, "refined", has_moments=True)
    flags.add_experiment_output(parser, "refine", is_main=False)
    _add_refinement(parser)
    flags.add_where(parser, "strokes that may change")
    flags.add_draw(parser)
    flags.add_prune(parser)
    flags.add_cluster(parser)
    flags.add_stroke_passes(parser)
    flags.add_palette(parser)
    flags.add_span(parser, "of a moving scene, whose strokes are written at 24 moments a second")
    flags.add_report(parser)


def _add_refinement(parser: ArgumentParser) -> None:
    group = parser.add_argument_group("refinement", "needs PyTorch: pip install torch")
    group.add_argument(
        "--to",
        choices=("self", "style"),
        help="target: 'self', the plain picture of the scene (default), or 'style', a style image (default "
        "with --style)",
    )
    flags.add_up(group)
    refine = flags.ConfigFlags(group, "refine")
    refine.add(
        "--style",
        type=Path,
        metavar="FILE",
        help="painting, or style file that was learnt from one (`brushgs style learn`): strokes become its "
        "marks, with brushes cut out of it, in its colours; default none",
    )
    refine.add(
        "--params",
        choices=get_args(Params),
        help="parameters of the strokes that are fitted: 'colour' alone, 'free' all but opacity, 'all' "
        "(default)",
    )
    refine.add(
        "--steps",
        type=values.count_from(1),
        metavar="N",
        help="maximum number of steps, 1 or more, default 900 (100 with --style)",
    )
    refine.add(
        "--views",
        type=values.count_from(1),
        metavar="N",
        help="number of training views around the scene, 1 or more, default 320 (24 with --style)",
    )
    refine.add(
        "--size",
        type=values.picture_size,
        metavar="WxH",
        help="size of the training views in pixels, default 384x288",
    )
    refine.add(
        "--vgg-weights",
        type=Path,
        metavar="FILE",
        help="torchvision's weights of VGG-16 or VGG-19 (.pth), default those in torch's cache, else "
        "features that need none",
    )
    refine.add(
        "--resume",
        field="is_resumed",
        action="store_true",
        help="resume a refinement that was stopped, from its .checkpoint beside the output; where there is "
        "none it starts anew",
    )


def run(args: Namespace) -> None:
    """Write the refined strokes."""
    config = refine_config(args)
    paint, scene = paint_config(args), scene_source(args)
    from brushgs.refine.report import RefineReport
    from brushgs.refine.run import refine_file

    report = RefineReport()
    with reported(args, report):
        clip = open_clip(args, scene)
        suffix = SCENE_SUFFIXES[0] if clip is None else ""
        output = args.output or output_beside(scene, "refined", suffix)
        refine_file(
            clip or scene,
            output,
            paint,
            config,
            report=report,
            folder=args.report,
            wants_plot=not args.no_plot,
        )


def refine_config(args: Namespace) -> "RefineConfig":
    """What is fitted, to what, and for how long.

    Raises:
        ValueError: if a value is out of range, or flags exclude each other.
    """
    from brushgs.options.experiments import RefineConfig

    seed = flags.given(args, "cluster").get("seed", 0)
    asked = flags.given(args, "draw") | flags.given(args, "strokes")
    keeps = tuple(name for name in ("stroke", "direction", "broken_color") if name in asked)
    config = RefineConfig(seed=seed, where=where_config(args), keeps=keeps, **flags.given(args, "refine"))
    if args.to == "style" and config.style is None:
        raise ValueError("--to style needs --style, the style image")
    if args.to == "self" and config.style is not None:
        raise ValueError("--to self cannot be combined with --style; omit one")
    return config
