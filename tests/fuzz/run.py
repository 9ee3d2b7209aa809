"""Watches a worker that reads damaged files; reports crashes, hangs and faults, each with its input saved."""

import json
import mmap
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from importlib.util import find_spec
from pathlib import Path

from tests.fuzz.worker import STATE

SECONDS_PER_INPUT = 5.0  # a file of 64 KiB that takes longer hangs
_ROOT = Path(__file__).resolve().parent.parent.parent
_POLL = 0.1


@dataclass
class Outcome:
    """What came of feeding one reader.

    Attributes:
        reader: its name.
        engine: "atheris" or "mutate".
        inputs: files read.
        seconds: how long that took.
        crashes: times the process died of a signal or ended by itself.
        hangs: inputs that took longer than `SECONDS_PER_INPUT`.
        faults: other breaches of the rules, each kind once: {"input": file, "what": sentence}.
        worst_memory: the most that one input made the process grow by, bytes.
    """

    reader: str
    engine: str
    inputs: int = 0
    seconds: float = 0.0
    crashes: int = 0
    hangs: int = 0
    faults: list[dict[str, str]] = field(default_factory=list)
    worst_memory: int = 0

    @property
    def is_clean(self) -> bool:
        """Whether every input gave a sound value or a sentence."""
        return not (self.crashes or self.hangs or self.faults)

    def as_json(self) -> str:
        """For a file."""
        return json.dumps(asdict(self) | {"is_clean": self.is_clean}, indent=1)


def best_engine() -> str:
    """`atheris` if it is installed, which is guided by coverage, else random mutation."""
    return "atheris" if find_spec("atheris") else "mutate"


def fuzz(
    reader: str,
    folder: Path,
    *,
    engine: str = "mutate",
    seed: int = 0,
    max_inputs: int = 1 << 60,
    seconds: float = 1e9,
    seconds_per_input: float = SECONDS_PER_INPUT,
) -> Outcome:
    """Feed a reader until so many inputs or seconds are over; a worker that dies is replaced.

    Args:
        reader: "module:name" of a `Reader`, or the name of one in `readers`; with chance as engine also
            several, joined by "+", which are read one after the other.
        folder: for inputs at fault and the result.
        engine: "mutate", or "atheris" if that is installed.
        seed: the same seed gives the same inputs, with "mutate" and up to the first crash or hang.
        max_inputs: files read of each reader.
        seconds: time.
        seconds_per_input: what takes longer is a hang.
    """
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "faults.jsonl").unlink(missing_ok=True)
    (folder / "state").write_bytes(STATE.pack(0, 0, time.monotonic(), 0))
    outcome = Outcome(reader, engine)
    target = reader if ":" in reader else f"tests.fuzz.readers:{reader}"
    start = time.monotonic()
    with _shared(folder / "state") as state:
        while time.monotonic() - start < seconds:
            left = seconds - (time.monotonic() - start)
            arguments = [target, str(folder), engine, str(seed), str(max_inputs), str(left)]
            end = _watch(arguments, folder, state, seconds_per_input, seconds - (time.monotonic() - start))
            seed += 1
            outcome.inputs, begun, _, outcome.worst_memory = STATE.unpack(state[:])
            if end == "done":
                break
            outcome.hangs += end == "hang"
            outcome.crashes += end != "hang"
            name = f"{'hang' if end == 'hang' else 'crash'}-{begun}"
            if (folder / "input").exists():
                (folder / name).write_bytes((folder / "input").read_bytes())
            with (folder / "faults.jsonl").open("a") as file:
                file.write(json.dumps({"input": name, "what": end}) + "\n")
            outcome.inputs = begun
            state[:] = STATE.pack(begun, begun, time.monotonic(), outcome.worst_memory)
            if outcome.crashes + outcome.hangs >= 50:
                break
    outcome.seconds = time.monotonic() - start
    if (folder / "faults.jsonl").exists():
        outcome.faults = [json.loads(line) for line in (folder / "faults.jsonl").read_text().splitlines()]
    (folder / "outcome.json").write_text(outcome.as_json())
    return outcome


def _watch(arguments: list[str], folder: Path, state: mmap.mmap, limit: float, seconds: float) -> str:
    """Run one worker to its end: "done", "hang", or how it died."""
    environment = os.environ | {"PYTHONPATH": str(_ROOT), "MALLOC_ARENA_MAX": "2"}
    with (folder / "worker.log").open("ab") as log:
        streams = {"stdout": log, "stderr": log, "stdin": subprocess.DEVNULL}
        command = [sys.executable, "-m", "tests.fuzz.worker", *arguments]
        process = subprocess.Popen(command, env=environment, cwd=_ROOT, **streams)
    last_moment = time.monotonic() + seconds + limit + 30
    try:
        while (code := process.poll()) is None:
            time.sleep(_POLL)
            done, begun, since, _ = STATE.unpack(state[:])
            if begun > done and time.monotonic() - since > limit:
                return "hang"
            if time.monotonic() > last_moment:
                return "done"
    finally:
        if process.poll() is None:
            process.kill()
        process.wait()
    if code <= 0:
        return "done" if code == 0 else f"died of {signal.Signals(-code).name}"
    return f"ended with {code}: {(folder / 'worker.log').read_text(errors='replace')[-600:]}"


@contextmanager
def _shared(path: Path) -> Iterator[mmap.mmap]:
    with path.open("r+b") as file, mmap.mmap(file.fileno(), STATE.size) as state:
        yield state
