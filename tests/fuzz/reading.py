"""Damaged files read one after the other, and judged: the inside of the process that `run.py` watches."""

import hashlib
import json
import mmap
import random
import resource
import sys
import time
from pathlib import Path

from tests.fuzz.judge import judged
from tests.fuzz.mutate import MAX_LENGTH, mutate
from tests.fuzz.reader import Reader
from tests.fuzz.worker import STATE

ALLOWED = 100 << 20  # bytes of memory beside twice the file
# Address space that is reserved and hardly used: stacks and heaps of the threads that a reader starts.
_RESERVED = 96 << 20
_KEPT = 200  # inputs kept to be damaged further
_FAULTS_KEPT = 40  # of one process: a fault that repeats is reported once


class Worker:
    """Reads inputs, judges them, and writes down what it found.

    Args:
        reader: what to read.
        folder: for inputs, the state and the faults.
        seed: of all chance.
    """

    def __init__(self, reader: Reader, folder: Path, seed: int) -> None:
        self.reader, self.folder, self.rng = reader, folder, random.Random(seed)
        self.work = folder / "work"
        self.work.mkdir(exist_ok=True)
        seeds = folder / "seeds"
        seeds.mkdir(exist_ok=True)
        self.seeds = [data[:MAX_LENGTH] for data in reader.seeds(seeds)]
        with (folder / "state").open("r+b") as file:
            self.state = mmap.mmap(file.fileno(), STATE.size)
        self.done, self.begun, _, self.worst = STATE.unpack(self.state[:])
        self.reported: set[str] = set()

    def warm_up(self) -> None:
        """Load what is loaded once, so that no input is charged with it."""
        for data in self.seeds:
            self.read(data, is_limited=False)

    def read(self, data: bytes, *, is_limited: bool = True) -> None:
        """One input; what it asks for beyond the rule is refused, whether it would use it or not."""
        (self.folder / "input").write_bytes(data)
        path = self.reader.write(data, self.work)
        self._note(begun=True)
        Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
        before = memory("VmRSS")
        if is_limited:
            _limit(memory("VmSize") + ALLOWED + 2 * len(data) + _RESERVED)
        fault = judged(self.reader.read, path)
        _limit(resource.RLIM_INFINITY)
        grown = memory("VmHWM") - before
        beyond = grown - 2 * len(data)
        if beyond > ALLOWED:
            fault = fault or f"memory: {grown >> 20} MiB for {len(data)} bytes"
        self.worst = max(self.worst, grown)
        self._note(begun=False)
        if fault is not None:
            self._report(data, fault)

    def _note(self, *, begun: bool) -> None:
        self.begun += begun
        self.done += not begun
        self.state[:] = STATE.pack(self.done, self.begun, time.monotonic(), self.worst)

    def _report(self, data: bytes, fault: str) -> None:
        kind = "".join(c for c in fault.split(":")[0] + fault[:40] if not c.isdigit())
        if kind in self.reported or len(self.reported) >= _FAULTS_KEPT:
            return
        self.reported.add(kind)
        name = f"fault-{hashlib.blake2b(data, digest_size=6).hexdigest()}"
        (self.folder / name).write_bytes(data)
        with (self.folder / "faults.jsonl").open("a") as file:
            file.write(json.dumps({"input": name, "what": fault}) + "\n")

    def run(self, max_inputs: int, seconds: float) -> None:
        """Mutate and read; a few inputs are kept, so that damage piles up on damage."""
        pool, end = list(self.seeds), time.monotonic() + seconds
        last = max_inputs + self.done - len(self.seeds)
        while self.done < last and time.monotonic() < end:
            data = mutate(self.rng, self.rng.choice(pool), self.seeds, self.reader.tokens)
            if self.rng.random() < 0.02:
                if len(pool) >= len(self.seeds) + _KEPT:
                    pool.pop(self.rng.randrange(len(self.seeds), len(pool)))
                pool.append(data)
            self.read(data)

    def run_atheris(self, max_inputs: int, seconds: float) -> None:
        """The same, led by which lines of brushgs are reached; ends the process."""
        import atheris  # type: ignore[import-not-found,unused-ignore]

        corpus = self.folder / "corpus"
        corpus.mkdir(exist_ok=True)
        for index, data in enumerate(self.seeds):
            (corpus / f"seed-{index}").write_bytes(data)

        def other(data: bytes, max_size: int, seed: int) -> bytes:
            if seed % 2:
                return bytes(atheris.Mutate(data, max_size))
            return mutate(random.Random(seed), bytes(data), self.seeds, self.reader.tokens)[:max_size]

        options = {"max_len": MAX_LENGTH, "max_total_time": round(seconds), "rss_limit_mb": 0}
        options |= {"runs": min(max_inputs - self.done, (1 << 31) - 1), "timeout": 3600, "verbosity": 0}
        options |= {"seed": self.rng.randrange(1, 1 << 31), "artifact_prefix": f"{self.folder}/"}
        options |= {f"handle_{name}": 0 for name in ("segv", "bus", "abrt", "ill", "fpe")}
        flags = [f"-{name}={value}" for name, value in options.items()]
        atheris.Setup([sys.argv[0], *flags, str(corpus)], self.read, custom_mutator=other)
        self.warm_up()
        atheris.Fuzz()


def _limit(size: int) -> None:
    """Let the process have so much address space, until that is said anew."""
    resource.setrlimit(resource.RLIMIT_AS, (size, resource.RLIM_INFINITY))


def memory(field: str) -> int:
    """Bytes, as the system counts them for this process."""
    with Path("/proc/self/status").open("rb") as file:
        line = next(line for line in file if line.startswith(field.encode()))
    return int(line.split()[1]) << 10
