"""`brushgs stability`: measure how stable strokes are along a camera path or on a moving scene; figures and a
plot.

Without a look, bare strokes are measured.
"""

from argparse import ArgumentParser, Namespace

from brushgs.cli import flags
from brushgs.cli.clips import open_clip
from brushgs.cli.configs import paint_config, path_config, scene_source
from brushgs.cli.console import output_beside, reported
from brushgs.options.choices import PLAIN_LOOK

SIZE = (640, 360)  # pixels: a quarter of those of a picture
ORBIT = 120  # frames, 3 degrees apart


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add_scene(parser)
    flags.add_experiment_output(parser, "stability")
    flags.add(parser, "stability")
    flags.add_look(parser, usual=PLAIN_LOOK)
    flags.add_draw(parser, has_look=True)
    flags.add(parser, "prune")
    flags.add_cluster(parser, has_look=True)
    flags.add(parser, "cluster", "strokes_for")
    flags.add_passes(parser)
    flags.add_framing(parser, size="640x360")
    default = f"--orbit {ORBIT}; a fixed camera for a moving scene"
    group = ("path", f"the frames, default {default}")
    flags.add(parser, "path", group=group, defaults={"orbit": str(ORBIT)})
    flags.add(parser, "hand")
    flags.add(parser, "clip")
    flags.add(parser, flags.ReportFlags)


def run(args: Namespace) -> None:
    """Measure, and write the report."""
    paint, scene = paint_config(args, view={"size": SIZE}), scene_source(args)
    from brushgs.cli.origin import output_of
    from brushgs.measure.stability import StabilityReport, report_stability
    from brushgs.options.experiments import StabilityConfig

    config = StabilityConfig(**flags.given(args, "stability"))
    report = StabilityReport()
    wants_plot = not args.no_plot
    with reported(args, report):
        output = output_of(args, output_beside(scene, "stability", ""))
        clip = open_clip(args, scene)
        path = path_config(args, default_orbit=None if clip else ORBIT, is_moving=clip is not None)
        report_stability(clip or scene, output, paint, path, config, report=report, wants_plot=wants_plot)
