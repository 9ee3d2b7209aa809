"""`brushgs refine`: fit strokes to the plain picture of their scene, or to a style image."""

from argparse import ArgumentParser, Namespace
from typing import Annotated, ClassVar, Literal

from brushgs.cli import flags
from brushgs.cli.clips import open_clip
from brushgs.cli.configs import paint_config, scene_source, where_config
from brushgs.cli.console import output_beside, reported
from brushgs.formats.registry import SCENE_SUFFIXES
from brushgs.options.experiments import RefineConfig
from brushgs.options.table import Options, option
from brushgs.options.where import Where, WhereConfig


class Target(Options, frozen=True):
    """The target of the fit."""

    GROUP: ClassVar = RefineConfig.GROUP
    ABOUT: ClassVar = RefineConfig.ABOUT
    # fmt: off
    to: Annotated[Literal["self", "style"] | None, option("target: 'self', the plain picture of the scene, "
        "or 'style', a style image", default="self, with --style style")] = None
    # fmt: on


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add_scene(parser)
    flags.add_scene_output(parser, "refined", has_moments=True)
    flags.add_experiment_output(parser, "refine", is_main=False)
    flags.add(parser, Target)
    flags.add(parser, "view", "up", group=(Target.GROUP, Target.ABOUT))
    flags.add(parser, "refine")
    flags.add_where(parser, "strokes that may change")
    flags.add_draw(parser)
    flags.add(parser, "prune")
    flags.add_cluster(parser)
    flags.add(parser, "strokes")
    flags.add(parser, "palette")
    about = "of a moving scene; strokes are written at 24 moments per second"
    flags.add(parser, "clip", "start", "end", group=("clip", about))
    flags.add(parser, flags.ReportFlags)


def run(args: Namespace) -> None:
    """Write the refined strokes."""
    config = refine_config(args)
    paint, scene = paint_config(args), scene_source(args)
    from brushgs.cli.origin import check_kept, output_of
    from brushgs.refine.report import RefineReport
    from brushgs.refine.run import checkpoint_of, refine_file

    report = RefineReport()
    with reported(args, report):
        clip = open_clip(args, scene)
        suffix = SCENE_SUFFIXES[0] if clip is None else ""
        goes_on = (lambda path: checkpoint_of(path).exists()) if config.is_resumed else None
        check_kept(args, args.report)
        output = output_of(args, output_beside(scene, "refined", suffix), is_ours=goes_on)
        refine_file(
            clip or scene,
            output,
            paint,
            config,
            report=report,
            folder=args.report,
            wants_plot=not args.no_plot,
        )


def refine_config(args: Namespace) -> RefineConfig:
    """The options of refinement.

    Raises:
        ValueError: if a value is out of range, or flags exclude each other.
    """
    seed = flags.given(args, "cluster").get("seed", 0)
    asked = flags.given(args, "draw") | flags.given(args, "strokes")
    keeps = tuple(name for name in ("stroke", "direction", "broken_color") if name in asked)
    given, where = flags.given(args, "refine"), flags.given(args, "where")
    of_all = {name: value for name, value in where.items() if name != "expression"}
    regions = tuple(WhereConfig(Where.parse(rate.of), **of_all) for rate in given.get("region_rates", ()))
    # The cameras of masks, and the model of words, may be for the regions alone.
    part = None if regions and "expression" not in where else where_config(args)
    config = RefineConfig(seed=seed, where=part, keeps=keeps, regions=regions, **given)
    if args.to == "style" and config.style is None:
        raise ValueError("--to style needs --style, the style image")
    if args.to == "self" and config.style is not None:
        raise ValueError("--to self cannot be combined with --style; omit one")
    return config
