"""Programs of Python that tests start; they find this package, whatever is installed."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]


def start(*words: object, env: dict[str, str] | None = None, **options: Any) -> subprocess.Popen[str]:
    """Python with these words, such as "-m", "brushgs", and variables; its output goes to pipes."""
    options = dict.fromkeys(("stdout", "stderr"), subprocess.PIPE) | options
    environment = os.environ | {"PYTHONPATH": str(ROOT)} | (env or {})
    command = [sys.executable, *map(str, words)]
    return subprocess.Popen(command, env=environment, text=True, encoding="utf-8", **options)


def ran(*words: object, **options: Any) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of `start`."""
    with start(*words, **options) as process:
        out, err = process.communicate(timeout=600)
    return process.returncode, out, err
