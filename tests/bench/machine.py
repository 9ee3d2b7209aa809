"""What a benchmark ran on, in one line: commit, compiler, processor, threads; a debug build is refused."""

import platform
import re
import subprocess
from pathlib import Path

from brushgs import _core
from brushgs.threads import num_threads_or_default


def describe() -> str:
    """Commit, compiler and build of the core, processor and the threads that the process may use.

    Raises:
        RuntimeError: if the core was built without optimisation.
    """
    compiler, is_optimised = _core.build()
    if not is_optimised:
        raise RuntimeError("bench: the core is a debug build; build it with CMAKE_BUILD_TYPE=Release")
    return (
        f"commit {_commit()}, core built by {compiler} ({_core.isa()} in use), "
        f"Python {platform.python_version()}, {_processor()}, {num_threads_or_default(None)} threads"
    )


def _commit() -> str:
    here = Path(__file__).parent
    command = ["git", "-C", str(here), "describe", "--always", "--dirty", "--abbrev=10"]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    return run.stdout.strip() or "unknown"


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    names = re.findall(r"model name\s*:\s*(.+)", info.read_text()) if info.exists() else []
    return names[0] if names else platform.processor()
