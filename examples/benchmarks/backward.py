"""Time and memory of the gradients beside painting alone, and beside plain torch with autograd.

    python -m examples.benchmarks.backward [--strokes 250 7000] [--size 800x800] [--threads 2] [--no-torch]

"frame" is `brushgs.render` without gradients; "with gradients" is `brushgs.autograd.render` and its backward
pass to all columns of the Gaussians. The yardstick T (torch_painter.py) paints the same boxes in torch; it is
compared with `brushgs.autograd.rasterize`, both from boxes to gradients by boxes. Pictures and gradients of
the two are checked against each other first, then timed interleaved. Milliseconds are medians
(minimum-maximum) of the wall clock, or with --processor-time of what all threads took, which hardly depends
on what else runs.

Memory is the peak of a process of its own, which paints, or paints and differentiates, the same strokes with
other opacities: the fainter, the more fragments lie in front of each other before a pixel is finished, while
the pairs of tiles and boxes stay the same.
"""

import argparse
import json
import re
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

import brushgs as bg
import brushgs.autograd as ba
from brushgs.rendering.backward import BOX_COLUMNS, GAUSSIAN_COLUMNS
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from examples.benchmarks import numpy_painter, torch_painter, workloads
from examples.benchmarks.machine import describe

TEXTURE = bg.StrokeTexture.from_coverage(workloads.swirl())
OPACITIES = (1.0, 0.3, 0.05)  # of all strokes: what makes more fragments count
MEMORY_STROKES = 7000
SLOW = 500.0  # milliseconds: what takes longer is timed `SLOW_REPEAT` times only
SLOW_REPEAT = 3

Clock = Callable[[], float]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--strokes", type=int, nargs="+", default=[250, 7000, 150_000])
    parser.add_argument("--size", default="800x800", help="WIDTHxHEIGHT")
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--repeat", type=int, default=15, help="rounds; T gets 3")
    parser.add_argument("--no-torch", action="store_true", help="leave T out: it takes seconds and gigabytes")
    parser.add_argument("--no-memory", action="store_true")
    parser.add_argument("--memory-of", help=argparse.SUPPRESS)  # what a process of its own measures
    parser.add_argument("--processor-time", action="store_true", help="of all threads, for a busy machine")
    arguments = parser.parse_args()
    clock = time.process_time if arguments.processor_time else time.perf_counter
    width, height = (int(side) for side in arguments.size.lower().split("x"))
    camera = workloads.camera(width, height)
    if arguments.memory_of:
        print(json.dumps(peak_of(camera, *json.loads(arguments.memory_of))))
        return
    print(describe() + f", torch {torch.__version__}", flush=True)
    for n in arguments.strokes:
        for threads in arguments.threads:
            time_strokes(n, camera, threads, arguments.repeat, clock)
            if not arguments.no_torch and n <= MEMORY_STROKES:
                time_torch(n, camera, threads, arguments.repeat, clock)
    if not arguments.no_memory:
        show_memory(arguments)


def weights_of(camera: Camera) -> torch.Tensor:
    """The gradient of the loss by the picture."""
    return torch.randn(camera.height, camera.width, 3, generator=torch.Generator().manual_seed(1))


def time_strokes(n: int, camera: Camera, threads: int, repeat: int, clock: Clock) -> None:
    scene, v_rgb = workloads.strokes(n), weights_of(camera)
    strokes = ba.Gaussians.of(scene, requires_grad=True)
    columns = [getattr(strokes, name) for name in GAUSSIAN_COLUMNS]
    for filter in ("bilinear", "mip"):
        how = {"filter": filter, "depth": False, "num_threads": threads}

        def with_gradients(how=how) -> object:
            frame = ba.render(strokes, camera, TEXTURE, **how)
            return torch.autograd.grad(frame.rgb, columns, v_rgb)

        calls = {
            "frame": lambda how=how: bg.render(scene, camera, TEXTURE, **how),
            "with gradients": with_gradients,
        }
        times = measure(calls, repeat, clock)
        print(f"{n:,} strokes, {filter}, {camera.width}x{camera.height}, {threads} threads")
        show(times)
        show_ratio("with gradients / frame", times["with gradients"], times["frame"])


def time_torch(n: int, camera: Camera, threads: int, repeat: int, clock: Clock) -> None:
    torch.set_num_threads(threads)
    boxes = ba.Boxes.of(bg.project(workloads.strokes(n), camera, lock="anchor"), requires_grad=True)
    columns = {name: getattr(boxes, name) for name in BOX_COLUMNS}
    inputs = [columns[name] for name in BOX_COLUMNS if name != "depths"]
    coverage, v_rgb = torch.tensor(TEXTURE.coverage / 255, dtype=torch.float32), weights_of(camera)
    size = {"width": camera.width, "height": camera.height}

    def ours() -> tuple[torch.Tensor, ...]:
        frame = ba.rasterize(boxes, TEXTURE, **size, filter="bilinear", depth=False, num_threads=threads)
        return (frame.rgb.detach(), *torch.autograd.grad(frame.rgb, inputs, v_rgb))

    def plain() -> tuple[torch.Tensor, ...]:
        rgb, _ = torch_painter.paint(columns, coverage, **size)
        return (rgb.detach(), *torch.autograd.grad(rgb, inputs, v_rgb))

    rgb, *gradients = ours()
    other, *others = plain()
    off = float((rgb - other).abs().mean())
    far = max(float((a - b).norm() / b.norm()) for a, b in zip(gradients, others, strict=True))
    if off > 1e-5 or far > 2e-2:  # float32 at kinks and thresholds: single fragments fall on the other side
        raise RuntimeError(f"bench: T paints another picture: {off:.1e}, gradients {far:.1e}")
    times = measure({"rasterize and gradients": ours, "T": plain}, repeat, clock)
    print(
        f"{n:,} strokes from boxes, bilinear, {threads} threads; T differs by {off:.1e}, gradients {far:.1e}"
    )
    show(times)
    show_ratio("T / rasterize and gradients", times["T"], times["rasterize and gradients"])


def measure(calls: dict[str, Callable[[], object]], repeat: int, clock: Clock) -> dict[str, list[float]]:
    """Milliseconds of each call, interleaved, after one round that is not counted."""
    times: dict[str, list[float]] = {name: [] for name in calls}
    for turn in range(repeat + 1):
        for name, call in calls.items():
            if len(times[name]) >= SLOW_REPEAT and np.median(times[name]) > SLOW:
                continue
            start = clock()
            call()
            if turn:
                times[name].append(1e3 * (clock() - start))
    return times


def show(times: dict[str, list[float]]) -> None:
    for name, values in times.items():
        spread = f"({min(values):.2f}-{max(values):.2f}), {len(values)} rounds"
        print(f"  {name:24} {np.median(values):9.2f} ms {spread}", flush=True)


def show_ratio(name: str, over: list[float], under: list[float]) -> None:
    print(f"  {name:24} {np.median(over) / np.median(under):.2f}, of minima {min(over) / min(under):.2f}")


def strokes_at(opacity: float) -> Gaussians:
    scene = workloads.strokes(MEMORY_STROKES)
    return replace(scene, opacities=np.full_like(scene.opacities, opacity))


def peak_of(camera: Camera, who: str, opacity: float) -> float:
    """Peak memory of this process, MB, once it has painted, or painted and differentiated."""
    scene = strokes_at(opacity)
    how = {"filter": "bilinear", "depth": False}
    if who == "frame":
        for _ in range(3):
            bg.render(scene, camera, TEXTURE, **how)
    elif who == "gradients":
        strokes = ba.Gaussians.of(scene, requires_grad=True)
        for _ in range(3):
            rgb = ba.render(strokes, camera, TEXTURE, **how).rgb
            torch.autograd.grad(
                rgb, [getattr(strokes, name) for name in GAUSSIAN_COLUMNS], weights_of(camera)
            )
    else:
        boxes = ba.Boxes.of(bg.project(scene, camera, lock="anchor"), requires_grad=True)
        columns = {name: getattr(boxes, name) for name in BOX_COLUMNS}
        coverage = torch.tensor(TEXTURE.coverage / 255, dtype=torch.float32)
        rgb, _ = torch_painter.paint(columns, coverage, width=camera.width, height=camera.height)
        torch.autograd.grad(rgb, columns["centers"], weights_of(camera))
    status = Path("/proc/self/status").read_text()
    return int(re.search(r"VmHWM:\s*(\d+) kB", status)[1]) / 1024


def show_memory(arguments: argparse.Namespace) -> None:
    width, height = (int(side) for side in arguments.size.lower().split("x"))
    camera = workloads.camera(width, height)
    who = ["frame", "gradients"] + ([] if arguments.no_torch else ["T"])
    print(f"Peak memory of a process with {MEMORY_STROKES:,} strokes, MB")
    print("  opacity  fragments  " + "  ".join(f"{name:>9}" for name in who))
    for opacity in OPACITIES:
        boxes = bg.project(strokes_at(opacity), camera, lock="anchor", fade=True)
        size = {"width": width, "height": height}
        *_, fragments = numpy_painter.paint(boxes, TEXTURE.coverage, **size, count=True)
        peaks = []
        for name in who:
            command = [sys.executable, "-m", "examples.benchmarks.backward", "--size", arguments.size]
            command += ["--memory-of", json.dumps([name, opacity])]
            peaks.append(float(subprocess.run(command, check=True, capture_output=True, text=True).stdout))
        print(
            f"  {opacity:7.2f}  {fragments / 1e6:7.2f} M  " + "  ".join(f"{peak:9.0f}" for peak in peaks),
            flush=True,
        )


if __name__ == "__main__":
    main()
