"""Time of `rasterize` beside two yardsticks, on the workloads of the benchmarks.

    python -m examples.benchmarks.raster [--strokes 250 7000 150000] [--size 800x800] [--threads 1 2]
                                         [--isa avx2]

Yardsticks: S, a plain scalar rasteriser in C++ (scanline.cpp), and N, one in NumPy (numpy_painter.py, one
thread). All paint the same boxes and are checked against each other first; then they are timed interleaved
in one process. Milliseconds are medians (minimum-maximum) of the wall clock. A fragment is a pixel center
inside a box whose pixel is not finished, counted once by N: it does not depend on who paints. "frame" is
projection and rasterisation; the yardsticks get the same projection. "soft" boxes have softness.
--isa runs one process each.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from brushgs import _core
from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering.project import project
from brushgs.rendering.rasterize import rasterize
from brushgs.rendering.render import render
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from examples.benchmarks import numpy_painter, scanline, workloads
from examples.benchmarks.machine import describe

PLAIN = 116_000  # Gaussians of the plain render: as many as a small trained scene has
SLOW = 500.0  # milliseconds: what takes longer is timed `SLOW_REPEAT` times only
SLOW_REPEAT = 3


def main() -> None:
    arguments = parse()
    if arguments.isa:
        results = [run_apart(isa) for isa in arguments.isa]
    else:
        machine = describe()
        if not arguments.json:
            print(machine, flush=True)
        results = [{"machine": machine, "isa": _core.isa(), "rows": run(arguments)}]
    if arguments.json:
        print(json.dumps(results, indent=1))


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--strokes", type=int, nargs="+", default=[250, 7000, 150_000])
    parser.add_argument("--size", default="800x800", help="WIDTHxHEIGHT")
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--isa", nargs="+", choices=["baseline", "avx2", "avx512"], help="a process for each")
    parser.add_argument("--repeat", type=int, default=11, help="rounds, at least 9 for a claim")
    parser.add_argument(
        "--no-numpy", action="store_true", help="leave N out after the check: it takes seconds"
    )
    parser.add_argument("--no-plain", action="store_true", help="leave the plain Gaussian render out")
    parser.add_argument("--json", action="store_true")
    return parser.parse_args()


def run_apart(isa: str) -> Any:
    """This benchmark in a process of its own, where the core reads the instruction set anew."""
    passed_on = [word for word in sys.argv[1:] if word not in ("--isa", "baseline", "avx2", "avx512")]
    command = [sys.executable, "-m", "examples.benchmarks.raster", *passed_on]
    is_json = "--json" in passed_on
    run = subprocess.run(
        command, env={**os.environ, "BRUSHGS_ISA": isa}, check=True, capture_output=is_json, text=True
    )
    return json.loads(run.stdout)[0] if is_json else None


def run(arguments: argparse.Namespace) -> list[dict[str, Any]]:
    width, height = (int(side) for side in arguments.size.lower().split("x"))
    camera, paint_scanline = workloads.camera(width, height), scanline.load()
    rows = []
    for n in arguments.strokes:
        rows += run_strokes(n, camera, paint_scanline, arguments)
    if not arguments.no_plain:
        rows += run_plain(camera, arguments)
    return rows


def run_strokes(
    n: int, camera: Camera, paint_scanline: scanline.Painter, arguments: argparse.Namespace
) -> list[dict[str, Any]]:
    gaussians, coverage = workloads.strokes(n), workloads.swirl()
    texture = StrokeTexture.from_coverage(coverage)
    boxes, soft = (project(gaussians, camera, order=order) for order in ("depth", "soft"))
    size = {"width": camera.width, "height": camera.height}
    fragments = check(boxes, texture, camera, paint_scanline)
    rows = []
    for threads in arguments.threads:
        how = {**size, "num_threads": threads}
        calls: dict[str, Callable[[], object]] = {
            "bilinear": lambda how=how: rasterize(boxes, texture, filter="bilinear", depth=False, **how),
            "bilinear, depth": lambda how=how: rasterize(boxes, texture, filter="bilinear", **how),
            "mip": lambda how=how: rasterize(boxes, texture, filter="mip", depth=False, **how),
            "mip, soft": lambda how=how: rasterize(soft, texture, filter="mip", depth=False, **how),
            "nearest": lambda how=how: rasterize(boxes, texture, filter="nearest", depth=False, **how),
            "frame": lambda t=threads: render(
                gaussians, camera, texture, filter="bilinear", depth=False, num_threads=t
            ),
            "projection": lambda t=threads: project(gaussians, camera, num_threads=t),
            "S": lambda t=threads: paint_scanline(boxes, coverage, camera.width, camera.height, t),
        }
        if not arguments.no_numpy:
            calls["N"] = lambda: numpy_painter.paint(boxes, coverage, **size)
        times = measure(calls, arguments.repeat)
        rows.append(report(f"{n:,} strokes", threads, times, fragments, arguments))
    return rows


def run_plain(camera: Camera, arguments: argparse.Namespace) -> list[dict[str, Any]]:
    """The plain 3DGS picture: many small Gaussians, cut at 3 standard deviations."""
    gaussians, texture = workloads.strokes(PLAIN), StrokeTexture.open("gaussian")
    boxes = project(gaussians, camera, num_sigmas=3.0)
    rows = []
    for threads in arguments.threads:
        how = {"width": camera.width, "height": camera.height, "depth": False, "num_threads": threads}
        calls: dict[str, Callable[[], object]] = {
            "gaussian": lambda how=how: rasterize(boxes, texture, **how),
            "frame": lambda t=threads: render(gaussians, camera, texture, depth=False, num_threads=t),
        }
        times = measure(calls, arguments.repeat)
        rows.append(report(f"{PLAIN:,} plain", threads, times, None, arguments))
    return rows


def check(boxes: Boxes, texture: StrokeTexture, camera: Camera, paint_scanline: scanline.Painter) -> int:
    """Refuse to time what does not paint the same picture; returns the fragments visited."""
    size = {"width": camera.width, "height": camera.height}
    frame = rasterize(boxes, texture, filter="bilinear", **size)
    rgb, transmittance, fragments = numpy_painter.paint(boxes, texture.coverage, **size, count=True)
    agree("N", frame, rgb, 1 - transmittance)
    rgb, transmittance = paint_scanline(boxes, texture.coverage, camera.width, camera.height, 2)
    agree("S", frame, rgb, 1 - transmittance)
    return fragments


def agree(name: str, frame: Frame, rgb: np.ndarray, alpha: np.ndarray) -> None:
    off = np.abs(frame.rgb - rgb).max(axis=2)
    mean, far = float(off.mean()), float((off > 1 / 255).mean())
    if mean > 1e-5 or far > 1e-4 or np.abs(frame.alpha - alpha).mean() > 1e-5:
        raise RuntimeError(f"bench: {name} paints another picture: mean {mean:.1e}, beyond a step {far:.1e}")


def measure(calls: dict[str, Callable[[], object]], repeat: int) -> dict[str, list[float]]:
    """Milliseconds of each call, interleaved, after one round that is not counted."""
    times: dict[str, list[float]] = {name: [] for name in calls}
    for turn in range(repeat + 1):
        for name, call in calls.items():
            if len(times[name]) >= SLOW_REPEAT and np.median(times[name]) > SLOW:
                continue
            start = time.perf_counter()
            call()
            if turn:
                times[name].append(1e3 * (time.perf_counter() - start))
    return times


def report(
    title: str, threads: int, times: dict[str, list[float]], fragments: int | None, arguments: Any
) -> dict[str, Any]:
    """One row as data, printed as text unless --json is given."""
    median = {name: float(np.median(values)) for name, values in times.items()}
    row: dict[str, Any] = {
        "workload": title,
        "size": arguments.size,
        "threads": threads,
        "fragments": fragments,
        "ms": {
            name: {"median": median[name], "min": min(values), "max": max(values), "rounds": len(values)}
            for name, values in times.items()
        },
    }
    if fragments is not None:
        row["ratios"] = {
            "S / bilinear": median["S"] / median["bilinear"],
            "S frame / frame": (median["S"] + median["projection"]) / median["frame"],
            "mip, soft / mip": median["mip, soft"] / median["mip"],
            "mip / bilinear": median["mip"] / median["bilinear"],
            "fragments per second": 1e3 * fragments / median["bilinear"],
            "fragments per second, frame": 1e3 * fragments / median["frame"],
        }
        if "N" in median:
            row["ratios"]["N / bilinear"] = median["N"] / median["bilinear"]
            row["ratios"]["N frame / frame"] = (median["N"] + median["projection"]) / median["frame"]
    if not arguments.json:
        show(row)
    return row


def show(row: dict[str, Any]) -> None:
    fragments = "" if row["fragments"] is None else f", {row['fragments'] / 1e6:.3f} M fragments"
    print(f"{_core.isa()}, {row['workload']}, {row['size']}, {row['threads']} threads{fragments}")
    for name, ms in row["ms"].items():
        rounds = f"{ms['rounds']} rounds"
        print(f"  {name:16} {ms['median']:9.2f} ms ({ms['min']:.2f}-{ms['max']:.2f}), {rounds}")
    for name, ratio in row.get("ratios", {}).items():
        print(f"  {name:28} " + (f"{ratio / 1e9:.3f} G" if ratio > 1e6 else f"{ratio:.2f}"))
    sys.stdout.flush()


if __name__ == "__main__":
    main()
