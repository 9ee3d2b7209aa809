"""A scene larger than memory, under a limit:
`python -m examples.benchmarks.blocks [--rows 50000000] [--memory 8GB]`.

Writes a landscape of so many Gaussians without spherical harmonics to a temporary folder (68 bytes each), or
takes the file of --scene, and paints it in a process whose address space, and that of each process that it
starts, is limited to the memory. Prints the stages, the wall clock and the largest resident sets of the
process and of those that read blocks. With --check a scene that fits is painted in memory and in blocks of
several sizes, and the strokes are compared with the plain picture of the scene.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import brushgs as bg
from brushgs.formats.scenes.read import open_files
from brushgs.options.memory_size import parse_memory
from brushgs.pipeline.blocks.budget import Budget
from brushgs.pipeline.blocks.load import load_in_blocks
from examples.benchmarks.blocks_scene import write_landscape
from examples.benchmarks.machine import describe

BLOCK_ROWS = 1000, 7777, 1 << 18
NUM_VIEWS, SIZE = 4, {"width": 480, "height": 320}
CHILD = """
import resource, sys
limit, *words = sys.argv[1:]
resource.setrlimit(resource.RLIMIT_AS, (int(limit), int(limit)))
from brushgs.cli import main
code = main(words)
whose = resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN
own, others = (resource.getrusage(who).ru_maxrss / 1e6 for who in whose)
print(f"largest resident set {own:.2f} GB, of a process that reads blocks {others:.2f} GB", flush=True)
sys.exit(code)
"""


def main() -> None:
    options = parse()
    print(describe(), flush=True)
    with tempfile.TemporaryDirectory() as folder:
        path = options.scene or Path(folder, "landscape.ply")
        if options.scene is None:
            start = time.perf_counter()
            write_landscape(path, options.rows)
            print(
                f"written in {time.perf_counter() - start:.0f} s, {path.stat().st_size / 1e9:.2f} GB",
                flush=True,
            )
        if options.check:
            check(path, parse_memory(options.memory), options.strokes)
        else:
            paint(path, options.memory, options.strokes, Path(folder, "painting.png"))


def paint(path: Path, memory: str, strokes: int, output: Path) -> None:
    """Run the command under the limit, and let it report."""
    words = ["render", str(path), "--stroke", "swirl", "--strokes", str(strokes), "--memory", memory]
    start = time.perf_counter()
    command = [sys.executable, "-c", CHILD, str(parse_memory(memory)), *words, "-o", str(output)]
    subprocess.run(command, check=True)
    print(f"wall clock {time.perf_counter() - start:.0f} s", flush=True)


def check(path: Path, memory: int, strokes: int) -> None:
    """PSNR of strokes to the plain scene, in memory and in blocks; mean over views around it."""
    whole = bg.load(path)
    azimuths = np.linspace(0, 2 * np.pi, NUM_VIEWS, endpoint=False)
    cameras = [bg.frame_scene(whole, azimuth_deg=np.degrees(azimuth), **SIZE) for azimuth in azimuths]
    small = [camera.resized(300, 200) for camera in cameras]
    plain = [bg.render(whole, camera, "gaussian") for camera in cameras]

    def painted(scene: bg.Gaussians) -> list[bg.Frame]:
        made = bg.cluster(bg.prune(scene), strokes, views=small)
        return [bg.render(made, camera, "gaussian") for camera in cameras]

    print(f"in memory: {len(whole):,} Gaussians, {psnr(painted(whole), plain):.2f} dB", flush=True)
    first = None
    for block_rows in BLOCK_ROWS:
        merged, _ = load_in_blocks(open_files(path, None), None, Budget(memory), block_rows=block_rows)
        frames = painted(merged)
        first = first or frames
        same = "the same bits" if psnr(frames, first) > 150 else f"{psnr(frames, first):.1f} dB to the first"
        print(f"blocks of {block_rows:,}: {len(merged):,}, {psnr(frames, plain):.2f} dB, {same}", flush=True)


def psnr(frames: list[bg.Frame], others: list[bg.Frame]) -> float:
    """Mean over the views."""
    errors = [np.mean((a.rgb - b.rgb) ** 2) for a, b in zip(frames, others, strict=True)]
    return float(np.mean(-10 * np.log10(np.maximum(errors, 1e-20))))


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--rows", type=int, default=50_000_000)
    parser.add_argument("--memory", default="8GB")
    parser.add_argument("--strokes", type=int, default=7000)
    parser.add_argument("--scene", type=Path)
    parser.add_argument("--check", action="store_true")
    return parser.parse_args()


if __name__ == "__main__":
    main()
