"""A process that runs jobs of a batch one after another, and keeps what they have in common.

Tasks come as JSON on stdin, and a line of JSON goes to stdout as each ends.
"""

import io
import json
import os
import sys
import time
from contextlib import chdir, redirect_stderr, redirect_stdout
from typing import Any

from brushgs.pipeline.runner import Memory, holding

STOPPED = {129, 130, 143}  # exit codes of a command that was asked to stop


def main() -> None:
    """Run the tasks of stdin."""
    from brushgs.cli import main as run_command

    tasks: list[tuple[list[str], str]] = json.load(sys.stdin)
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    with holding(Memory() if len(tasks) > 1 else None):
        for words, folder in tasks:
            start, out, err = time.perf_counter(), io.StringIO(), io.StringIO()
            with chdir(folder), redirect_stdout(out), redirect_stderr(err):
                try:
                    code: Any = run_command(words)
                except SystemExit as end:  # of the parser
                    code = end.code
            answer = [time.perf_counter() - start, int(code or 0), out.getvalue(), err.getvalue()]
            print(json.dumps(answer), file=answers, flush=True)
            if code in STOPPED:
                sys.exit(code)
