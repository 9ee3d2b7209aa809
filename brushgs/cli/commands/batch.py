"""`brushgs batch`: many jobs, many scenes, looks and views, from one file."""

import shlex
import sys
from argparse import ArgumentParser, Namespace, RawDescriptionHelpFormatter
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from brushgs.cli import flags
from brushgs.cli.console import EXIT_BAD_INPUT, reported
from brushgs.options.table import Options, option

if TYPE_CHECKING:
    from brushgs.cli.batch.jobs import Job

EPILOG = """\
a file of jobs:
    [defaults]                              # of all jobs; options are named after flags
  size = "1280x720"

  [[job]]                                 # one picture
  scene = "garden.ply"
  output = "garden.png"

  [[job]]                                 # two scenes in two looks, from two sides: eight pictures
  output = "out/{scene}-{look}-{side}.png"
  [job.each]
  scene = ["garden.ply", "kitchen.spz"]
  look = ["oil", "charcoal"]
  side = [{ name = "front", from = "front" }, { name = "above", elevation = 60, zoom = 1.2 }]

  [[job]]
  command = "export"                      # another command than render
  scene = "garden.ply"
  output = "garden.html"

Files are named from the folder of this file, and folders of outputs are made. Every job is checked before the
first runs; one that fails does not stop the others, and the exit code is then 2."""


class Own(Options, frozen=True):
    """The file of jobs."""

    file: Annotated[Path, option("TOML file of jobs, see below", flag="file", default="", metavar="JOBS")]


class DryRun(Options, frozen=True):
    """Whether jobs are only checked."""

    dry_run: Annotated[bool, option("check all jobs, print them as command lines, and run none")] = False


# What options of frames say of jobs.
OF_JOBS = {
    "jobs": "jobs that run at the same time, each with its share of the processors",
    "scheduler": "Dask scheduler whose workers run the jobs, such as tcp://host:8786; they must see the "
    "same files under the same names",
    "is_resumed": "skip jobs that are done already: with the same options, scene and version, and with all "
    "files that they wrote as they left them",
}


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    parser.formatter_class = RawDescriptionHelpFormatter
    parser.epilog = EPILOG
    flags.add(parser, Own)
    flags.add(parser, "sequence", group=("", ""), words=OF_JOBS)
    flags.add(parser, DryRun)
    flags.add(parser, flags.ReportFlags)


def run(args: Namespace) -> int:
    """Run the jobs, and report them.

    Raises:
        KeyboardInterrupt: if it is stopped; says how to go on.
    """
    from brushgs.cli.batch.check import check_jobs
    from brushgs.cli.batch.jobs import read_jobs
    from brushgs.cli.batch.record import JobRecord
    from brushgs.options.sequence import SequenceConfig

    config = SequenceConfig(**flags.given(args, "sequence"))
    jobs = read_jobs(args.file)
    check_jobs(jobs)
    record = JobRecord(args.file, is_resumed=config.is_resumed)
    others = [job for job in jobs if not record.has(job)]
    if args.dry_run:
        _print(others, as_json=args.json)
        return 0
    from brushgs.cli.batch.report import BatchReport, Line
    from brushgs.cli.batch.run import run_jobs

    report = BatchReport()
    with reported(args, report), report.stage("batch", total=len(jobs), unit="jobs"):
        if record.note:
            report.tell(record.note)
        for number in {job.number for job in jobs} - {job.number for job in others}:
            report.add(Line.of(jobs[number - 1], None))
        try:
            with closing(run_jobs(others, config, report.tell)) as outcomes:
                for job, outcome in outcomes:
                    if not outcome.error:
                        record.add(job, outcome.written)
                    report.add(Line.of(job, outcome))
        except KeyboardInterrupt:
            left = len(jobs) - len(report.lines)
            raise KeyboardInterrupt(f"{left} of {len(jobs)} jobs are not done; --resume runs them") from None
    failed = [line for line in report.lines if line.state == "failed"]
    if args.quiet:  # no table, which names them
        for line in failed:
            print(f"brushgs: job {line.number}: {line.error}", file=sys.stderr)
    return EXIT_BAD_INPUT if failed else 0


def _print(jobs: "Sequence[Job]", *, as_json: bool) -> None:
    """The jobs as command lines, which are run in the folder of the file."""
    lines = [["brushgs", job.command, *job.words] for job in jobs]
    if as_json:
        import json

        print(json.dumps(lines, indent=2))
        return
    for line in lines:
        print(shlex.join(line))
