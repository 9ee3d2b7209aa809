"""Exit codes, names of outputs, and reports on stdout and stderr."""

import sys
import warnings
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from brushgs.errors import SceneWarning

if TYPE_CHECKING:
    from brushgs.options.scene_source import SceneSource
    from brushgs.pipeline.report import Report

EXIT_INTERNAL_ERROR, EXIT_BAD_INPUT, EXIT_FAULTY_SCENE = 1, 2, 3


def output_beside(scene: "SceneSource", ending: str, suffix: str) -> Path:
    """The default name of an output, in the current folder: koala.ply, "dry brush" -> koala-dry_brush.png."""
    return Path(f"{scene.name}-{'_'.join(ending.split())}{suffix}")


@contextmanager
def _kept(args: Namespace) -> Iterator[None]:
    """Results of slow steps are taken from the disk, and kept there, for commands that offer `--no-cache`."""
    if getattr(args, "no_cache", True):
        yield
        return
    from brushgs.pipeline.kept import keeping
    from brushgs.pipeline.runner import held, holding

    with keeping(held()) as memory, holding(memory):
        yield


@contextmanager
def reported(args: Namespace, report: "Report | None" = None) -> Iterator["Report"]:
    """A report, printed when the command ends: notes, table or JSON, and the output path.

    Args:
        args: parsed flags: `json`, `quiet`, `verbose`.
        report: of the command; None for a plain `Report`.
    """
    if report is None:
        from brushgs.pipeline.report import Report

        report = Report()
    is_for_people = not args.quiet and not args.json
    report.verbose = args.verbose
    report.tells = is_for_people
    report.shows_progress = is_for_people and sys.stderr.isatty()
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("ignore")
            warnings.simplefilter("always", SceneWarning)
            with _kept(args):
                yield report
    finally:
        report.close()
        notes = list(dict.fromkeys(str(warning.message) for warning in caught))  # each once
        report.notes += notes
        if is_for_people:
            for note in notes:
                print(f"brushgs: note: {note}", file=sys.stderr)
    if args.json:
        print(report.as_json())
    elif is_for_people:
        report.print_table()
        if report.output is not None:
            print(report.output)
