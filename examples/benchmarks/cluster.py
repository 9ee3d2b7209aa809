"""Seconds and inertia of the clustering methods, side by side.

    python -m examples.benchmarks.cluster [SCENE.ply ...] [--sizes 300000x7000 ...] [--without minibatch]
                                  [--repeat 3] [--json FILE]

Synthetic points are the lumpy sphere of the benchmarks, real ones the scenes named. All methods get the same
points ("balanced" features, equal weights), so that inertia compares; "best" is Lloyd until nothing gains.
Seconds are medians; that of minibatch, which takes minutes, is of one run, and holds no import. A method is
skipped by --without, or where N x k is above 4e9: mini batches then take a quarter of an hour.
"""

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

import brushgs as bg
from brushgs.passes.reduce.cluster import choose_method
from brushgs.passes.reduce.features import cluster_features
from brushgs.passes.reduce.lloyd import Clusters, assign, lloyd
from brushgs.passes.reduce.minibatch import minibatch
from brushgs.values.arrays import F32
from examples.benchmarks import workloads
from examples.benchmarks.machine import describe

SIZES = ["10000x250", "10000x2000", "100000x250", "100000x2000", "100000x10000"]
SIZES += ["300000x250", "300000x7000", "300000x30000", "1000000x100000"]
TOO_LONG = 4e9  # N x k of minibatch
COUNTS = (250, 2000, 7000)  # of real scenes
BEST_STEPS = 60


@dataclass(frozen=True)
class Run:
    points: str
    num_points: int
    num_clusters: int
    method: str
    seconds: float
    inertia: float
    relative: float  # to the best known
    num_steps: int
    num_found: int


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", type=Path)
    parser.add_argument("--sizes", nargs="*", default=SIZES, metavar="NxK")
    parser.add_argument("--without", nargs="*", default=[], choices=["minibatch", "best"])
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--json", type=Path, help="write the rows to this file, too")
    arguments = parser.parse_args()
    print(describe())
    print(
        f"{'points':10} {'N':>8} {'k':>7} {'method':10} {'seconds':>8} {'inertia':>12} "
        f"{'to best':>8} {'steps':>5}"
    )
    runs: list[Run] = []
    for size in arguments.sizes:
        num, k = (int(part) for part in size.split("x"))
        points = cluster_features(workloads.strokes(num, sh_degree=0))
        runs += compare("synthetic", points, k, arguments.without, arguments.repeat)
    for path in arguments.scenes:
        points = cluster_features(bg.prune(bg.load(path)))
        for k in COUNTS:
            runs += compare(path.stem.split(".")[0], points, k, arguments.without, arguments.repeat)
    if arguments.json:
        arguments.json.write_text(json.dumps([asdict(run) for run in runs], indent=1) + "\n")


def compare(name: str, points: F32, k: int, without: list[str], repeat: int) -> list[Run]:
    weights = np.ones(len(points))
    calls: dict[str, tuple[int, Callable[[], Clusters]]] = {
        "lloyd": (repeat, lambda: lloyd(points, weights, k)),
    }
    if "minibatch" not in without and len(points) * k <= TOO_LONG:
        import sklearn.cluster  # noqa: F401  (its import is not timed)

        calls["minibatch"] = 1, lambda: minibatch(points, weights, k, seed=0)
    if "best" not in without:
        calls["best"] = 1, lambda: lloyd(points, weights, k, num_steps=BEST_STEPS, gain=0.0)
    rows = []
    for method, (times, call) in calls.items():
        seconds = []
        for _ in range(times):
            begun = time.perf_counter()
            found = call()
            seconds.append(time.perf_counter() - begun)
        inertia = exact_inertia(points, found)
        rows.append((method, float(np.median(seconds)), inertia, found))
    best = min(row[2] for row in rows)
    runs = [
        Run(
            name,
            len(points),
            k,
            method,
            seconds,
            inertia,
            inertia / best,
            found.num_steps,
            found.num_clusters,
        )
        for method, seconds, inertia, found in rows
    ]
    chosen = choose_method(len(points), k)[0]
    for run in runs:
        mark = " <- auto" if run.method == chosen else ""
        print(
            f"{run.points:10} {run.num_points:8} {run.num_clusters:7} {run.method:10} {run.seconds:8.2f} "
            f"{run.inertia:12.6g} {run.relative:8.4f} {run.num_steps:5}{mark}",
            flush=True,
        )
    return runs


def exact_inertia(points: F32, found: Clusters) -> float:
    """Of all points to the nearest mean of a cluster found, computed apart from what the method says."""
    counts = np.bincount(found.labels, minlength=found.num_clusters)
    assert counts.min() > 0, "an empty cluster"
    centers = np.stack([np.bincount(found.labels, column) / counts for column in points.T], axis=1)
    distances, _ = assign(points, centers)
    inertia = float((distances**2).sum())
    assert inertia <= 1.02 * found.inertia, "the method says less than it costs"
    return inertia


if __name__ == "__main__":
    main()
