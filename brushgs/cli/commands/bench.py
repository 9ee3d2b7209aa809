"""`brushgs bench`: error against run time on one scene, in figures and a plot; or brushgs beside its peers.

Without a look, bare strokes are measured, so that curves stay comparable over versions. The peers are no part
of the package: their code is in the repository.
"""

import sys
from argparse import ArgumentParser, Namespace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from brushgs.cli import flags
from brushgs.cli.configs import look_of, paint_config, scene_source
from brushgs.cli.console import output_beside, reported
from brushgs.options.choices import PLAIN_LOOK
from brushgs.options.experiments import BenchConfig
from brushgs.options.table import Options, option

if TYPE_CHECKING:
    from brushgs.options.painting import PaintConfig

QUICK_SIZE = (640, 360)  # pixels; of peers too
PEERS = "examples.benchmarks.peers"  # a package of a checkout
PEER_STROKES = (2000,)


class Own(Options, frozen=True):
    """The options of this command alone."""

    # fmt: off
    quick: Annotated[bool, option("fewer counts and repeats at 640x360: under a minute on 100,000 Gaussians "
        "and two processors")] = False
    peers: Annotated[bool, option("measure brushgs beside other painters instead, on SCENE or without one on "
        "the example scene; --strokes (default 2000), --repeats (default 3), --quick (one round) and the "
        "view apply; needs a checkout of the repository")] = False
    peers_style: Annotated[Path | None, option("with --peers: painting whose style is aimed at; those beside "
        "it in its folder are what it is ranked among", default="a painting of the project's own",
        metavar="FILE")] = None
    im2oil: Annotated[Path | None, option("with --peers: folder of a checkout of Im2Oil, whose program is "
        "run beside them", default="none", metavar="FOLDER")] = None
    # fmt: on


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add_scene(parser)
    for action in parser._actions:
        if action.dest == "scene":  # --peers needs none
            action.nargs, action.required = "*", False
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
    if args.peers:
        run_peers(args)
        return
    for name, value in (("peers-style", args.peers_style), ("im2oil", args.im2oil)):
        if value is not None:
            raise ValueError(f"--{name} needs --peers; add it, or omit --{name}")
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


def run_peers(args: Namespace) -> None:
    """Measure brushgs beside its peers, and write the report."""
    paint = paint_config(args, view={"size": QUICK_SIZE})
    scene = scene_source(args) if args.scene else None
    run = _from_checkout()
    given = flags.given(args, "bench")
    rounds = given.get("repeats", 1 if args.quick else 3)
    ask = run.Ask(
        paint.view,
        tuple(given.get("strokes", PEER_STROKES)),
        args.peers_style,
        args.im2oil,
        rounds,
    )
    from brushgs.cli.origin import output_of

    report = run.PeersReport()
    with reported(args, report):
        default = Path("still-life-peers") if scene is None else output_beside(scene, "peers", "")
        run.report_peers(scene, output_of(args, default), ask, report=report, wants_plot=not args.no_plot)


def _from_checkout() -> Any:
    """The module that runs peers, of the checkout that this package lies in, or of the current folder.

    Raises:
        ValueError: if neither is a checkout.
    """
    for root in (Path(__file__).resolve().parents[3], Path.cwd()):
        if root.joinpath(*PEERS.split("."), "run.py").is_file():
            if str(root) not in sys.path:
                sys.path.insert(0, str(root))
            return import_module(f"{PEERS}.run")
    raise ValueError(
        "--peers needs the peers' code, which is in the repository, not in the package; run it in a checkout"
    )
