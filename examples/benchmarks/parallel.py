"""What `parallel_map` gains and costs: several processes beside one process with as many threads.

    python -m examples.benchmarks.parallel [--frames 60] [--strokes 7000] [--size 1280x720] [--jobs 2]
                                           [--repeat 5]

Both ways paint the same frames (uint8 pictures on white, as for a video) along an orbit, alternately, and are
first compared byte by byte. Each process must start, import what it needs and prepare its stroke image.
"after the start" excludes the first two frames per job. "start" is the time to the first result of work that
does nothing, "an item" the time of each further one, with one number and with one picture as the result.
Milliseconds and frames/s are medians (minimum-maximum) of the wall clock; memory is the largest resident set
of a process.
"""

import argparse
import itertools
import re
import statistics
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.texture import StrokeTexture
from brushgs.core.threads import num_threads_or_default
from brushgs.pipeline.parallel import parallel_map
from brushgs.rendering.render import render
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from examples.benchmarks import parallel as importable  # run with -m, this module is another one
from examples.benchmarks.machine import describe

NUM_ITEMS = 300  # of work that does nothing


class Painter:
    """A picture of strokes, uint8 [H, W, 3] on white, for a camera."""

    def __init__(self, strokes: Gaussians, texture: StrokeTexture) -> None:
        self.strokes, self.texture = strokes, texture

    def __call__(self, camera: Camera) -> NDArray[np.uint8]:
        frame = render(self.strokes, camera, self.texture, depth=False)
        return np.round(255 * frame.over((1, 1, 1))).astype(np.uint8)


class Memory(Painter):
    """The same, but what it returns is the largest resident set of its process so far, MB."""

    def __call__(self, camera: Camera) -> float:
        super().__call__(camera)
        status = Path("/proc/self/status").read_text()  # getrusage would count what the parent had
        return int(re.search(r"VmHWM:\s*(\d+)", status)[1]) / 1024


def nothing(result: object) -> object:
    """Work that does nothing."""
    return result


def main() -> None:
    options = parse()
    print(f"{describe()}, {options.jobs} jobs", flush=True)
    width, height = (int(side) for side in options.size.lower().split("x"))
    picture = np.zeros((height, width, 3), np.uint8)
    starts = [time_start(options.jobs) for _ in range(options.repeat)]
    print(f"start             {spread_of(starts, 1e3)} ms")
    for name, result in (("number", 1), ("picture", picture)):
        times = [time_items(result, options.jobs) for _ in range(options.repeat)]
        print(f"an item, {name:8} {spread_of(times, 1e3)} ms")
    compare(options, width, height)


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--strokes", type=int, default=7000)
    parser.add_argument("--size", default="1280x720", help="WIDTHxHEIGHT")
    parser.add_argument("--jobs", type=int, default=num_threads_or_default(None))
    parser.add_argument("--repeat", type=int, default=5)
    return parser.parse_args()


def compare(options: argparse.Namespace, width: int, height: int) -> None:
    """One process with all threads against several processes that share them, in turn."""
    from examples.benchmarks import workloads  # with SciPy, which the processes do not need

    texture = StrokeTexture.from_coverage(workloads.swirl())
    painter = importable.Painter(workloads.strokes(options.strokes), texture)
    cameras = orbit(options.frames, width, height)
    paths = {
        "one process": lambda: map(painter, cameras),
        f"{options.jobs} processes": lambda: parallel_map(painter, cameras, jobs=options.jobs),
    }
    one, several = (list(path()) for path in paths.values())
    assert all(np.array_equal(a, b) for a, b in zip(one, several, strict=True)), "the frames differ"
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in paths}
    for _ in range(options.repeat):
        for name, path in paths.items():
            times[name].append(time_path(path, 2 * options.jobs))
    rates = {name: [options.frames / whole for whole, _ in pairs] for name, pairs in times.items()}
    for name, values in rates.items():
        print(f"{name:17} {spread_of(values, 1)} frames/s")
    for number, words in enumerate(("start included", "after the start")):
        ratios = [a[number] / b[number] for a, b in zip(*times.values(), strict=True)]
        print(f"speed-up          {spread_of(ratios, 1)}, {words}")
    memory = importable.Memory(painter.strokes, texture)
    print(
        f"memory            {max(parallel_map(memory, cameras, jobs=options.jobs)):.0f} MB a process, ",
        end="",
    )
    print(f"{memory(cameras[0]):.0f} MB this one")


def orbit(num_frames: int, width: int, height: int) -> list[Camera]:
    """A turn around the workload."""
    turns = 2 * np.pi * np.arange(num_frames) / num_frames
    eyes = 3 * np.stack([np.sin(turns), np.full(num_frames, 0.3), np.cos(turns)], axis=1)
    return [Camera.look_at(eye, (0, 0, 0), (0, 1, 0), width=width, height=height) for eye in eyes]


def time_start(jobs: int) -> float:
    """Seconds from asking for the first result until it is there."""
    results = parallel_map(importable.nothing, [1], jobs=jobs)
    start = time.perf_counter()
    next(results)
    seconds = time.perf_counter() - start
    results.close()
    return seconds


def time_items(result: object, jobs: int) -> float:
    """Seconds each further item takes that comes back as it was sent."""
    results = parallel_map(importable.nothing, itertools.repeat(result), jobs=jobs)
    for _ in range(2 * jobs):
        next(results)
    start = time.perf_counter()
    for _ in range(NUM_ITEMS):
        next(results)
    seconds = (time.perf_counter() - start) / NUM_ITEMS
    results.close()
    return seconds


def time_path(path: Callable[[], Iterable[object]], num_first: int) -> tuple[float, float]:
    """Seconds for all frames, each let go as soon as it is there, and for all but the first ones."""
    start = after = time.perf_counter()
    for index, _ in enumerate(path(), 1):
        if index == num_first:
            after = time.perf_counter()
    end = time.perf_counter()
    return end - start, end - after


def spread_of(values: list[float], factor: float) -> str:
    """Median (minimum-maximum)."""
    low, middle, high = (factor * value for value in (min(values), statistics.median(values), max(values)))
    return f"{middle:.2f} ({low:.2f}-{high:.2f})"


if __name__ == "__main__":
    main()
