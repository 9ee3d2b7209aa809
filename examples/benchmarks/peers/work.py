"""One peer in a process of its own: its pictures, strokes, flips, seconds and memory."""

import multiprocessing
import re
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from brushgs.pipeline.report import peak_memory
from examples.benchmarks.peers.columns import flips
from examples.benchmarks.peers.task import Task


@dataclass(frozen=True)
class Painted:
    """What came of a task.

    Attributes:
        pictures: [H, W, 3] of 8 bits, as files hold them; one per camera.
        strokes: of the first picture; None for a painter without strokes.
        flips: half turns over all steps; None where no stroke lasts from picture to picture.
        memory_mb: the most that the process held.
        processor: seconds of all its threads, from the start of the process; other work hardly changes them.
        seconds: from the start of the process until the last picture was here.
    """

    pictures: tuple[NDArray[np.uint8], ...]
    strokes: int | None
    flips: int | None
    memory_mb: float | None
    processor: float
    seconds: float = 0.0


def in_own_process(peer: str, task: Task) -> Painted:
    """Start Python, paint, and take the pictures over; what the peer raises is raised here."""
    start = time.perf_counter()
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        found = pool.apply(work, (peer, task))
        seconds = time.perf_counter() - start
    return replace(found, seconds=seconds)


def work(peer: str, task: Task) -> Painted:
    """The same in this process, without seconds."""
    from examples.benchmarks.peers.registry import PEERS

    painter = PEERS[peer].open(task)
    rows = range(len(task.cameras))
    pictures = tuple(np.rint(255 * painter.paint(index)).astype(np.uint8) for index in rows)
    turned = None
    if len(rows) > 1:
        coats = [painter.boxes(index) for index in rows]
        known = [each for each in coats if each is not None]
        if known:
            turned = flips(known, task.cameras[0].width, task.cameras[0].height)
    return Painted(pictures, painter.strokes, turned, _memory_mb(), time.process_time())


def _memory_mb() -> float | None:
    """Of this process alone: on Linux `getrusage` counts what its parent held when it was started."""
    status = Path("/proc/self/status")
    found = re.search(r"VmHWM:\s+(\d+) kB", status.read_text()) if status.exists() else None
    if found is not None:
        return int(found[1]) / 1024
    peak = peak_memory()
    return None if peak is None else peak / 2**20
