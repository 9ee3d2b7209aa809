"""Time of `project`: the compiled core beside its NumPy definition, on the workloads of the benchmarks.

    python -m examples.benchmarks.project [--sizes 7000 150000 1500000] [--threads 1 2] [--repeat 21]

Results are checked before they are timed. Instruction sets run in processes of their own; all else is
interleaved in one process. Milliseconds are medians (minimum-maximum) of the wall clock; "cpu" is the
smallest CPU time of the process, which other work on the machine disturbs less.
"""

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Callable

import numpy as np

from brushgs import _core
from brushgs.rendering import reference
from brushgs.rendering.project import project
from brushgs.values.gaussians import Gaussians
from examples.benchmarks import workloads
from examples.benchmarks.machine import describe

SIZE = 800  # pixels, both sides
REFERENCE_SIZE = 150_000  # above it, the NumPy definition is skipped: it takes seconds
MEAN_HALF_EXTENTS = {  # 800x800, rounded up to whole pixels: the check that the workload is the same
    250: (63.15, 24.66),
    7000: (20.49, 8.35),
    150_000: (7.88, 3.54),
}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sizes", type=int, nargs="+", default=[7000, 150_000, 1_500_000])
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--repeat", type=int, default=21)
    parser.add_argument("--isa", help="time this instruction set only, in this process")
    arguments = parser.parse_args()
    if arguments.isa is None:
        print(describe(), flush=True)
        for isa in ("baseline", "avx2", "avx512"):
            command = [sys.executable, "-m", "examples.benchmarks.project", *sys.argv[1:], "--isa", isa]
            subprocess.run(command, env={**os.environ, "BRUSHGS_ISA": isa}, check=True)
    elif _core.isa() == arguments.isa:  # else this processor does not have it
        for n in arguments.sizes:
            run_size(n, arguments.threads, arguments.repeat)


def run_size(n: int, threads: list[int], repeat: int) -> None:
    gaussians = workloads.strokes(n)
    check(gaussians)
    camera = workloads.camera(SIZE, SIZE)
    calls: dict[str, Callable[[], object]] = {
        f"{num} thread{'s' * (num > 1)}": lambda num=num: project(gaussians, camera, num_threads=num)
        for num in threads
    }
    if n <= REFERENCE_SIZE and _core.isa() == "baseline":
        calls["NumPy definition, float64"] = lambda: reference.project(gaussians, camera)
    for name, (wall, cpu) in measure(calls, repeat).items():
        spread = f"{np.median(wall):8.2f} ms ({min(wall):.2f}-{max(wall):.2f}), cpu {min(cpu):.2f}"
        print(f"{_core.isa():9} {n:8,} strokes  {name:26} {spread}", flush=True)


def check(gaussians: Gaussians) -> None:
    """The workload is the published one, and the core agrees with the definition on a part of it."""
    camera = workloads.camera(SIZE, SIZE)
    boxes = project(gaussians, camera)
    if len(gaussians) in MEAN_HALF_EXTENTS:
        rounded = np.ceil(boxes.half_extents).mean(axis=0)
        np.testing.assert_allclose(rounded, MEAN_HALF_EXTENTS[len(gaussians)], rtol=0.01)
    part = gaussians.take(slice(0, 20_000))
    actual, expected = project(part, camera), reference.project(part, camera)
    actual_order, expected_order = np.argsort(actual.ids), np.argsort(expected.ids)
    for name in ("ids", "centers", "half_extents", "angles", "depths", "colors"):
        np.testing.assert_allclose(
            getattr(actual, name)[actual_order],
            getattr(expected, name)[expected_order],
            rtol=1e-4,
            atol=1e-5,
        )


Times = tuple[list[float], list[float]]  # milliseconds of wall clock and of CPU


def measure(calls: dict[str, Callable[[], object]], repeat: int) -> dict[str, Times]:
    """Milliseconds of wall clock and of CPU of each call, interleaved, after one that is not counted."""
    times: dict[str, Times] = {name: ([], []) for name in calls}
    for turn in range(repeat + 1):
        for name, call in calls.items():
            wall, cpu = time.perf_counter(), time.process_time()
            call()
            if turn:
                times[name][0].append(1e3 * (time.perf_counter() - wall))
                times[name][1].append(1e3 * (time.process_time() - cpu))
    return times


if __name__ == "__main__":
    main()
