"""The command line: text in, exit codes out. No arithmetic, and nothing heavy is imported before it is used.

Exit codes: 0 done, 1 a fault of brushgs itself, 2 an input that cannot be used (one sentence on stderr),
3 a fault that `brushgs doctor` found in a scene, 130 stopped with Ctrl-C. stdout carries data only: the path
that was written, JSON, or what was asked for.
"""

import os
import sys
import warnings
from argparse import Namespace
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from brushgs.cli import flags as arguments
from brushgs.errors import SceneWarning

if TYPE_CHECKING:
    from brushgs.painting.report import Report

EXIT_FAULT, EXIT_INPUT, EXIT_ILL, EXIT_STOPPED = 1, 2, 3, 130
DEMO_SIZE = (1200, 900)
DEMO_GROUND = "#2e2113"  # painters tone a canvas: what strokes leave open stays warm and dark


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        argv: the words after the name of the program; None for those of this process.

    Returns:
        The exit code.
    """
    if "numpy" not in sys.modules:
        # The matrices here are small: BLAS threads mostly wait for each other. Without them a painting of
        # 250 strokes takes 0.86 of the time (two cores, busy elsewhere). Our own threads are our own.
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    is_debug = False
    try:
        args = arguments.parse(sys.argv[1:] if argv is None else argv)
        is_debug = args.debug
        exit_code = COMMANDS[args.command](args)
        sys.stdout.flush()
    except KeyboardInterrupt as stop:
        return _say(f"stopped: {stop}" if str(stop) else "stopped", EXIT_STOPPED)
    except BrokenPipeError:  # the reader of stdout, `head` for one, has gone: nobody is left to tell
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except (ValueError, OSError, MemoryError) as error:
        if is_debug:
            raise
        return _say(_sentence(error), EXIT_INPUT)
    except Exception as error:
        if is_debug:
            raise
        name = type(error).__name__
        return _say(f"a fault of brushgs itself, {name}: {error}; run it again with --debug", EXIT_FAULT)
    return exit_code or 0


def _say(sentence: str, exit_code: int) -> int:
    print(f"brushgs: {' '.join(sentence.split())}", file=sys.stderr)
    return exit_code


def _sentence(error: BaseException) -> str:
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    if isinstance(error, MemoryError):
        return f"out of memory ({error}); take fewer pixels (--size) or a smaller scene"
    return str(error)


@contextmanager
def _told(args: Namespace, report: "Report | None" = None) -> Iterator["Report"]:
    """A report that is told when the command ends: notes, table or JSON, and the path that was written."""
    if report is None:
        from brushgs.painting.report import Report

        report = Report()
    report.shows_progress = sys.stderr.isatty() and not args.quiet and not args.json
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("ignore")
            warnings.simplefilter("always", SceneWarning)
            yield report
    finally:
        report.close()
        report.notes = [str(warning.message) for warning in caught]
        if not args.quiet and not args.json:
            for note in report.notes:
                print(f"brushgs: note: {note}", file=sys.stderr)
    if args.json:
        print(report.as_json())
    elif not args.quiet:
        report.print_table()
        if report.output is not None:
            print(report.output)


def _render(args: Namespace) -> None:
    path = arguments.path_config(args)
    config, sequence = arguments.paint_config(args), arguments.sequence_config(args)
    name = _beside(args.scene, Path(args.stroke).stem, ".png" if path is None else ".mp4")
    output = args.output or name
    if path is None:
        with _told(args) as report:
            from brushgs.painting.still import paint_file

            paint_file(args.scene, output, config, report=report)
    else:
        with _told(args) as report:
            from brushgs.painting.sequence import paint_sequence

            paint_sequence(args.scene, output, path, config, sequence, report=report)


def _demo(args: Namespace) -> None:
    with _told(args) as report:
        from brushgs.painting.demo import paint_demo

        paint_demo(
            args.output,
            draw=arguments.draw_config(args, background=DEMO_GROUND),
            cluster=arguments.cluster_config(args),
            size=args.size or DEMO_SIZE,
            report=report,
        )


def _prune(args: Namespace) -> None:
    config = arguments.prune_config(args)
    with _told(args) as report:
        from brushgs.painting.still import prune_file

        prune_file(args.scene, args.output or _beside(args.scene, "pruned", ".ply"), config, report)


def _cluster(args: Namespace) -> None:
    config = arguments.cluster_config(args)
    with _told(args) as report:
        from brushgs.painting.still import cluster_file

        cluster_file(args.scene, args.output or _beside(args.scene, "strokes", ".ply"), config, report)


def _recolor(args: Namespace) -> None:
    config = arguments.palette_config(args)
    assert config is not None, "the parser demands a palette"
    with _told(args) as report:
        from brushgs.painting.still import recolor_file

        recolor_file(args.scene, args.output or _beside(args.scene, "recolored", ".ply"), config, report)


def _refine(args: Namespace) -> None:
    paint, config = arguments.refine_configs(args)
    from brushgs.refine.report import RefineReport
    from brushgs.refine.run import refine_file

    report = RefineReport()
    with _told(args, report):
        output = args.output or _beside(args.scene, "refined", ".ply")
        refine_file(
            args.scene,
            output,
            paint,
            config,
            report=report,
            folder=args.report,
            wants_plot=not args.no_plot,
        )


def _stability(args: Namespace) -> None:
    paint, path, config = arguments.stability_configs(args)
    from brushgs.measure.stability import StabilityReport, report_stability

    report = StabilityReport()
    with _told(args, report):
        report_stability(
            args.scene,
            args.output or _beside(args.scene, "stability", ""),
            paint,
            path,
            config,
            report=report,
            wants_plot=not args.no_plot,
        )


def _bench(args: Namespace) -> None:
    paint, config = arguments.bench_configs(args)
    from brushgs.measure.bench import BenchReport, report_bench

    report = BenchReport()
    output = args.output or _beside(args.scene, "bench", "")
    with _told(args, report):
        report_bench(args.scene, output, paint, config, report=report, wants_plot=not args.no_plot)


def _doctor(args: Namespace) -> int:
    from brushgs.doctor.run import DoctorReport, run_doctor

    report = DoctorReport()
    with _told(args, report):
        run_doctor(args.scene, args.fix, floaters=args.floaters, report=report)
    return EXIT_ILL if report.has_faults else 0


def _strokes(args: Namespace) -> None:
    import json

    from brushgs.brushes.texture import builtin_names

    print(json.dumps(builtin_names()) if args.json else "\n".join(builtin_names()))


def _info(args: Namespace) -> None:
    import json

    from brushgs.doctor.describe import describe

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", SceneWarning)
        facts = describe(args.scene)
    facts["notes"] = [str(warning.message) for warning in caught]
    if args.json:
        print(json.dumps(facts, indent=2))
        return
    for name, value in facts.items():
        for item in value if name == "notes" else [value]:
            print(f"{name.removesuffix('s') if name == 'notes' else name.replace('_', ' '):16} {_text(item)}")


def _text(value: object) -> str:
    if isinstance(value, list):
        return "  ".join(_text(item) for item in value)
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:,}" if isinstance(value, int) else str(value)


def _beside(scene: Path, ending: str, suffix: str) -> Path:
    """Name of an output in the current folder: koala.ply, swirl -> koala-swirl.png."""
    stem = scene.stem.removesuffix(".compressed")
    return Path(f"{stem}-{'_'.join(ending.split())}{suffix}")


COMMANDS: dict[str, Callable[[Namespace], int | None]] = {
    "render": _render,
    "demo": _demo,
    "prune": _prune,
    "cluster": _cluster,
    "recolor": _recolor,
    "refine": _refine,
    "stability": _stability,
    "bench": _bench,
    "doctor": _doctor,
    "strokes": _strokes,
    "info": _info,
}
