"""`brushgs doctor`: report faults and oddities of a scene file, and write a fixed copy."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Annotated

from brushgs.cli import flags
from brushgs.cli.configs import scene_source
from brushgs.cli.console import EXIT_FAULTY_SCENE, reported
from brushgs.options.choices import Clean
from brushgs.options.table import Options, option


class Own(Options, frozen=True):
    """The options of this command alone."""

    # fmt: off
    fix: Annotated[Path | None, option("write the fixed scene to this file ({scene_suffixes})")] = None
    clean: Annotated[Clean, option("floaters that --fix drops: 'sure' (clearly detached), 'strong' (closer "
        "ones too; loses some thin leaves) or 'off'")] = "sure"
    # fmt: on


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    parser.epilog = (
        "Exit codes: 0 if the scene has no fault or a fixed scene was written; 3 if a fault was found; 2 if "
        "the file cannot be used at all."
    )
    flags.add_scene(parser)
    flags.add(parser, Own)
    flags.add(parser, flags.NoClobberFlag)
    flags.add_no_cameras(parser)
    flags.add(parser, flags.ReportFlags)


def run(args: Namespace) -> int:
    """Report the findings, and write the fixed scene."""
    from brushgs.cli.origin import check_kept
    from brushgs.doctor.run import DoctorReport, run_doctor

    scene, report = scene_source(args), DoctorReport()
    with reported(args, report):
        check_kept(args, args.fix)
        run_doctor(scene, args.fix, clean=args.clean, report=report)
    return EXIT_FAULTY_SCENE if report.has_faults else 0
