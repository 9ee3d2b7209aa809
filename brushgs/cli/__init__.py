"""The command line: text in, exit codes out. No arithmetic; heavy modules are imported on use.

Data goes to stdout (output paths, JSON, the lists of `strokes` and `info`), everything else to stderr. Exit
codes: 0 success, 1 internal error, 2 unusable input (one sentence on stderr), 3 fault found by
`brushgs doctor`; 130, 143 and 129: stopped by Ctrl-C, SIGTERM and SIGHUP, after cleaning up.
"""

import gc
import os
import sys
from collections.abc import Sequence

from brushgs.cli.console import EXIT_BAD_INPUT, EXIT_INTERNAL_ERROR
from brushgs.cli.stopping import Stop, hearing_stops
from brushgs.cli.streams import forgiving_streams


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        argv: arguments after the program name; None for those of this process.

    Returns:
        The exit code.
    """
    if "numpy" in sys.modules:  # a program calls
        return _answered(argv)
    # Matrices are small, so BLAS threads mostly wait for each other: with one, a painting of 250 strokes
    # takes 0.86 of the time (two cores, shared). The core has its own threads.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Importing makes objects and no garbage. Looking for it every 700 objects, and again while Python exits,
    # takes 6 % of a painting of 250 strokes.
    gc.set_threshold(200_000)
    exit_code = _answered(argv)
    gc.freeze()
    return exit_code


def _answered(argv: Sequence[str] | None) -> int:
    with forgiving_streams() as stdout, hearing_stops() as stop:
        exit_code = _run(sys.argv[1:] if argv is None else argv, stop)
        stdout.flush()
        if stdout.error is None or isinstance(stdout.error, BrokenPipeError):  # `head` has read enough
            return exit_code
        return _failed(f"standard output: {_sentence(stdout.error)}; write it elsewhere", EXIT_BAD_INPUT)


def _run(words: Sequence[str], stop: Stop) -> int:
    """Run one command; errors become a sentence and an exit code."""
    is_debug = False
    try:
        from brushgs.cli.parser import parse  # here, so that an early Ctrl-C is caught

        args = parse(words)
        is_debug = args.debug
        exit_code: int | None = args.run(args)
    except KeyboardInterrupt as interrupt:
        return _failed(f"stopped: {interrupt}" if str(interrupt) else "stopped", stop.exit_code)
    except (ValueError, OSError, MemoryError) as error:
        if is_debug:
            raise
        return _failed(_sentence(error), EXIT_BAD_INPUT)
    except Exception as error:
        if is_debug:
            raise
        name = type(error).__name__
        return _failed(
            f"internal error, {name}: {error}; run again with --debug for the traceback", EXIT_INTERNAL_ERROR
        )
    return exit_code or 0


def _failed(sentence: str, exit_code: int) -> int:
    print(f"brushgs: {' '.join(sentence.split())}", file=sys.stderr)
    return exit_code


def _sentence(error: BaseException) -> str:
    path = getattr(error, "filename", None) or getattr(error, "path", None)
    sentence = _plain_sentence(error)
    if path is None or "no such file" not in sentence.lower() or os.path.lexists(path):
        return sentence
    from difflib import get_close_matches

    folder, name = os.path.split(os.fspath(path))
    try:
        near = get_close_matches(name, os.listdir(folder or os.curdir), n=1, cutoff=0.75)  # noqa: PTH208
    except OSError:
        near = []
    return f"{sentence}; did you mean {os.path.join(folder, near[0])}?" if near else sentence  # noqa: PTH118


def _plain_sentence(error: BaseException) -> str:
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    if isinstance(error, MemoryError):
        return f"out of memory ({error}); use a smaller picture (--size) or a smaller scene"
    return str(error)
