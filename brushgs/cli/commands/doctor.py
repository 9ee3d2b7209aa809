"""`brushgs doctor`: faults and oddities of a scene file, and a fixed copy of it."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import get_args

from brushgs.cli import flags
from brushgs.cli.configs import scene_source
from brushgs.cli.console import EXIT_FAULTY_SCENE, reported
from brushgs.io.scenes.formats import SCENE_SUFFIXES
from brushgs.options.choices import Clean


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    parser.epilog = (
        "Exit codes: 0 if the scene has no fault or a fixed scene was written; 3 if a fault was found; 2 if "
        "the file cannot be used at all."
    )
    flags.add_scene(parser)
    parser.add_argument(
        "--fix",
        type=Path,
        metavar="FILE",
        help=f"write the fixed scene to this file ({', '.join(SCENE_SUFFIXES)}); default none",
    )
    parser.add_argument(
        "--clean",
        choices=get_args(Clean),
        default="sure",
        help="floaters that --fix drops: 'sure': clearly detached (default), 'strong': closer ones too, "
        "which loses some thin leaves; 'off': none",
    )
    flags.add_no_cameras(parser)
    flags.add_report(parser)


def run(args: Namespace) -> int:
    """Report the findings, and write the fixed scene."""
    from brushgs.doctor.run import DoctorReport, run_doctor

    scene, report = scene_source(args), DoctorReport()
    with reported(args, report):
        run_doctor(scene, args.fix, clean=args.clean, report=report)
    return EXIT_FAULTY_SCENE if report.has_faults else 0
