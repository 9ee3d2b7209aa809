"""The cost of the lock: tracking directions along a camera path, beside drawing its frames.

    python -m tests.bench.lock [SCENE.ply ...] [--up +z] [--strokes 2000 7000] [--size 1280x720] [--repeat 5]

Without a scene: the strokes of the benchmarks. The camera orbits the subject in 240 and in 120 frames (1.5
and 3 degrees apart), on an open and on a closed path, with the dry brush. All runs of a row alternate in one
process; times are medians, in milliseconds per frame: "tracking" chooses the directions, "draw" projects and
rasterises, as `render_sequence` does; "off" and "anchor" are the projection of a frame alone, "track" the
same with given directions. First the tracked sequence is checked: it must have neither flips nor spins.
"""

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import brushgs as bg
from brushgs.cameras.framing import up_vector
from brushgs.cameras.orbit import orbit
from brushgs.measure.box_events import orientation_events
from brushgs.rendering.project import project
from brushgs.rendering.track import track_directions
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from tests.bench import workloads
from tests.bench.machine import describe

DRAWN = 24  # frames of each path that are timed, evenly spaced: all of them would take minutes


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", type=Path)
    parser.add_argument("--up", default="-y")
    parser.add_argument("--strokes", type=int, nargs="+", default=[2000, 7000])
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--repeat", type=int, default=5)
    arguments = parser.parse_args()
    width, height = (int(side) for side in arguments.size.lower().split("x"))
    print(describe())
    print(f"{'scene':12} strokes frames path   tracking   draw  share |  project: off  anchor   track")
    for scene in arguments.scenes or [None]:
        for n in arguments.strokes:
            strokes = _strokes(scene, n)
            for num_frames in (240, 120):
                around = orbit(strokes, num_frames, width=width, height=height, up=up_vector(arguments.up))
                for cameras, name in ((around, "open"), ([*around, around[0]], "closed")):
                    check(strokes, cameras)
                    row = f"{scene.stem if scene else 'workload':12} {n:7} {num_frames:6} {name:6}"
                    print(row, measure(strokes, cameras, arguments.repeat), flush=True)


def _strokes(scene: Path | None, n: int) -> Gaussians:
    if scene is None:
        return workloads.strokes(n)
    return bg.cluster(bg.prune(bg.load(scene), 0.7), n)


def check(strokes: Gaussians, cameras: list[Camera]) -> None:
    """Raise if the tracked sequence flips or spins."""
    size = {"width": cameras[0].width, "height": cameras[0].height}
    events = orientation_events(bg.track(strokes, cameras, fade=True), **size)
    if events.flips or events.spins:
        raise RuntimeError(f"bench: the tracked sequence has {events.flips} flips, {events.spins} spins")


def measure(strokes: Gaussians, cameras: list[Camera], repeat: int) -> str:
    texture, path = bg.StrokeTexture.open("dry_brush"), track_directions(strokes, cameras)
    frames = np.linspace(0, len(cameras) - 1, DRAWN).astype(int)
    locks = {k: path.directions(int(k)) for k in frames}

    def draw() -> None:
        for k in frames:
            bg.render(strokes, cameras[k], texture, lock=path.directions(int(k)), order="soft", depth=False)

    def projects(lock: str | None) -> Callable[[], None]:
        def call() -> None:
            for k in frames:
                project(strokes, cameras[k], lock=lock or locks[k], fade=True)

        return call

    calls: dict[str, tuple[Callable[[], object], int]] = {
        "tracking": (lambda: track_directions(strokes, cameras), len(cameras)),
        "draw": (draw, DRAWN),
        "off": (projects("off"), DRAWN),
        "anchor": (projects("anchor"), DRAWN),
        "track": (projects(None), DRAWN),
    }
    times: dict[str, list[float]] = {name: [] for name in calls}
    for round_number in range(repeat + 1):  # the first one warms up
        for name, (call, num_frames) in calls.items():
            start = time.perf_counter()
            call()
            if round_number:
                times[name].append(1000 * (time.perf_counter() - start) / num_frames)
    ms = {name: float(np.median(values)) for name, values in times.items()}
    projected = f"{ms['off']:6.2f}  {ms['anchor']:6.2f}  {ms['track']:6.2f}"
    return f"{ms['tracking']:7.2f} {ms['draw']:7.2f} {ms['tracking'] / ms['draw']:6.1%} |      {projected}"


if __name__ == "__main__":
    main()
