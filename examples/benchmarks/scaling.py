"""How cost grows with strokes, pixels, Gaussians and frames, and what more cores would gain.

    python -m examples.benchmarks.scaling [--axes strokes pixels gaussians frames] [--most N]

Every point is measured in processes of its own, confined to one core and with two in turn: in each the median
of several rounds after one that fills the caches, of a slow point one; and of three such turns the quickest,
since a busy neighbor of either core would pass for a serial share. The exponent is that of the growth
since the row before: 1 is linear. The bottleneck is the stage that takes most of the time on two cores. The
serial share s follows from the two times by Amdahl's law, t2 / t1 = s + (1 - s) / 2, and with it the gain of
64 cores over one, 1 / (s + (1 - s) / 64). It is an estimate: it knows nothing of memory that 64 cores would
share.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

import brushgs as bg
from brushgs.brushes.texture import StrokeTexture
from brushgs.options.painting import ClusterConfig, DrawConfig, PaintConfig, ViewConfig
from brushgs.options.sequence import PathConfig, SequenceConfig
from brushgs.passes.reduce.cluster import cluster
from brushgs.passes.reduce.prune import prune
from brushgs.pipeline.sequence import paint_sequence
from brushgs.pipeline.still import paint_file
from brushgs.rendering.project import project
from brushgs.rendering.rasterize import rasterize
from brushgs.still_life import still_life
from examples.benchmarks import workloads
from examples.benchmarks.machine import describe
from examples.benchmarks.strokes import markdown

STROKES = 7000
SIZE = 1280, 720
ROUNDS, SLOW = 9, 2.0  # rounds of a point, and the seconds above which one is enough
TURNS = 3
MANY_CORES = 64

Stages = dict[str, float]  # seconds of each stage
Stage = tuple[str, Callable[[], object]]


def picture(num_strokes: int, width: int, height: int) -> list[Stage]:
    """A picture of so many strokes, as `brushgs render` makes one when the strokes are there."""
    gaussians, camera = workloads.strokes(num_strokes), workloads.camera(width, height)
    texture = StrokeTexture.from_coverage(workloads.swirl())
    boxes = project(gaussians, camera)
    frame = rasterize(boxes, texture, width=width, height=height)
    return [
        ("project", lambda: project(gaussians, camera)),
        ("rasterize", lambda: rasterize(boxes, texture, width=width, height=height)),
        ("round to bytes", lambda: frame.bytes_over((1.0, 1.0, 1.0))),
    ]


def abstraction(num_gaussians: int) -> list[Stage]:
    """So many Gaussians of one color, pruned as usual and clustered into `STROKES`."""
    gaussians = workloads.strokes(num_gaussians, sh_degree=0)
    kept = prune(gaussians)
    return [("prune", lambda: prune(gaussians)), ("cluster", lambda: cluster(kept, STROKES))]


def film(num_frames: int, jobs: int) -> Stages:
    """The stages of one picture, or of a film, of a small still life, in numbered files."""
    config = PaintConfig(
        view=ViewConfig(size=(480, 270)),
        cluster=ClusterConfig(strokes=2000),
        draw=DrawConfig(stroke="flat"),
    )
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "still_life.ply"
        bg.save(still_life(20_000), scene)
        if num_frames == 1:
            report = paint_file(scene, Path(folder) / "frame.png", config)
        else:
            path, sequence = PathConfig(orbit=num_frames), SequenceConfig(jobs=jobs)
            report = paint_sequence(scene, Path(folder) / "frames", path, config, sequence)
    stages = {"prepare": 0.0, "track": 0.0, "paint": 0.0, "write": 0.0}
    for stage in report.stages:
        name = "paint" if stage.name in ("project", "rasterise") else stage.name  # of one picture
        stages[name if name in stages else "prepare"] += stage.seconds
    return stages


def timed(stages: list[Stage]) -> Stages:
    """The median seconds of each stage."""
    seconds: dict[str, list[float]] = {name: [] for name, _ in stages}
    for _ in range(ROUNDS + 1):
        for name, work in stages:
            start = time.perf_counter()
            work()
            seconds[name].append(time.perf_counter() - start)
        if sum(each[-1] for each in seconds.values()) > SLOW:
            break
    return {name: median(each[1:] or each) for name, each in seconds.items()}


AXES: dict[str, tuple[str, tuple[int, ...], Callable[[int, int], Stages]]] = {
    "strokes": (
        f"strokes, {SIZE[0]}x{SIZE[1]}",
        (250, 1000, 4000, 16_000, 64_000, 250_000, 1_000_000),
        lambda n, _: timed(picture(n, *SIZE)),
    ),
    "pixels": (
        f"pixels, 16:9, {STROKES:,} strokes",
        (100_000, 400_000, 1_600_000, 8_300_000, 33_000_000),
        lambda n, _: timed(picture(STROKES, round(math.sqrt(n * 16 / 9)), round(math.sqrt(n * 9 / 16)))),
    ),
    "gaussians": (
        f"Gaussians into {STROKES:,} strokes",
        (10_000, 100_000, 1_000_000, 6_000_000),
        lambda n, _: timed(abstraction(n)),
    ),
    "frames": ("frames of 480x270, 2000 strokes; a process a core", (1, 10, 100, 1000), film),
}


def measure(axis: str, count: int) -> tuple[Stages, Stages]:
    """One point, on one core and on two."""
    best: list[Stages] = []
    for _ in range(TURNS):
        turn = [_run(axis, count, cores) for cores in (1, 2)]
        best = [
            min(pair, key=lambda stages: sum(stages.values()))
            for pair in zip(best or turn, turn, strict=True)
        ]
    return best[0], best[1]


def _run(axis: str, count: int, cores: int) -> Stages:
    """One point, in a process of its own on so many cores."""
    command = [sys.executable, "-m", "examples.benchmarks.scaling", "--point", axis, str(count), str(cores)]
    run = subprocess.run(command, check=True, capture_output=True, text=True)
    stages: Stages = json.loads(run.stdout)
    return stages


def print_point(axis: str, count: int, cores: int) -> None:
    """Measure one point in this process, and print it as JSON."""
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:cores])
    print(json.dumps(AXES[axis][2](count, cores)))


def table(axis: str, most: int) -> str:
    """The rows of one axis."""
    title, counts, _ = AXES[axis]
    rows, before = [], (0, 0.0)
    for count in counts:
        if count > most:
            break
        on_one, two = measure(axis, count)
        one, total = sum(on_one.values()), sum(two.values())
        exponent = f"{math.log(total / before[1]) / math.log(count / before[0]):.2f}" if before[0] else ""
        name = max(two, key=lambda stage: two[stage])
        serial = min(max(2 * total / one - 1, 0.0), 1.0)
        gain = 1 / (serial + (1 - serial) / MANY_CORES)
        shares = f"{name}, {two[name] / total:.0%}"
        rows.append(
            [f"{count:,}", seconds(one), seconds(total), exponent, shares, f"{serial:.0%}", f"{gain:.1f} x"]
        )
        before = count, total
        print(axis, *rows[-1], file=sys.stderr, flush=True)
    head = ["one core", "two cores", "exponent", "bottleneck", "serial", f"{MANY_CORES} cores"]
    return markdown([[title, *head], *rows])


def seconds(value: float) -> str:
    """With three digits."""
    return f"{1000 * value:.3g} ms" if value < 1 else f"{value:.3g} s"


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--axes", nargs="+", choices=tuple(AXES), default=tuple(AXES))
    parser.add_argument("--most", type=int, default=10**9, help="leave out points above this")
    parser.add_argument("--point", nargs=3, metavar=("AXIS", "COUNT", "CORES"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.point:
        axis, count, cores = arguments.point
        print_point(axis, int(count), int(cores))
        return
    print(describe())
    for axis in arguments.axes:
        print("\n" + table(axis, arguments.most), flush=True)


if __name__ == "__main__":
    main()
