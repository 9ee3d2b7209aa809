"""What a benchmark ran on, in one line: commit, compiler, processor, threads; a debug build is refused."""

import subprocess
from pathlib import Path

from brushgs.measure.bench.run import describe_machine


def describe() -> str:
    """Commit, compiler and build of the core, processor and the threads that the process may use.

    Raises:
        ValueError: if the core was built without optimization.
    """
    machine = describe_machine()
    return (
        f"commit {_commit()}, core built by {machine['compiler']} ({machine['isa']} in use), "
        f"Python {machine['python']}, {machine['processor']}, {machine['threads']} threads"
    )


def _commit() -> str:
    here = Path(__file__).parent
    command = ["git", "-C", str(here), "describe", "--always", "--dirty", "--abbrev=10"]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    return run.stdout.strip() or "unknown"
