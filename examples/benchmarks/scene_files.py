"""What rounding costs in each format of scene files that is written.

    python -m examples.benchmarks.scene_files [SCENE ...]

A scene is written, read back, and drawn as it is at 320 x 180 from two sides, on white; PSNR in dB to the
same picture of the scene as it was, the lower of both. Times are medians of 3.
"""

import argparse
import tempfile
import time
from pathlib import Path
from statistics import median

import numpy as np

import brushgs as bg
from brushgs.measure.likeness import psnr
from examples.benchmarks.machine import describe
from examples.benchmarks.scenes import present
from examples.benchmarks.strokes import FILES, SCENES, markdown

SUFFIXES = (".ply", ".glb", ".usdc", ".splat", ".compressed.ply", ".spz", ".sog")
SIZE = {"width": 320, "height": 180}


def pictures(scene: bg.Gaussians, cameras: list[bg.Camera]) -> list[np.ndarray]:
    return [bg.render(scene, camera, "gaussian").over("white") for camera in cameras]


def rows_of(name: str, folder: Path) -> list[list[str]]:
    source = SCENES[name].source()
    scene = source if isinstance(source, bg.Gaussians) else bg.load(source)
    cameras = bg.orbit(scene, 4, **SIZE)[::2]
    true = pictures(scene, cameras)
    rows = []
    for suffix in SUFFIXES:
        path, times = folder / f"scene{suffix}", ([], [])
        for _ in range(3):
            start = time.perf_counter()
            bg.save(scene, path)
            times[0].append(time.perf_counter() - start)
            start = time.perf_counter()
            again = bg.load(path)
            times[1].append(time.perf_counter() - start)
        near = min(psnr(*pair) for pair in zip(pictures(again, cameras), true, strict=True))
        of_file = [f"{path.stat().st_size / 1e6:.2f}", f"{median(times[0]):.2f}", f"{median(times[1]):.2f}"]
        what = f"{name}, {len(scene):,}, SH {scene.sh_degree}"
        rows.append([what, suffix, *of_file, "equal" if near >= 100 else f"{near:.0f}"])
    return rows


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=["koala", "truck", "skull"])
    names = present(parser.parse_args().scenes, FILES)
    print(describe())
    with tempfile.TemporaryDirectory() as folder:
        rows = [row for name in names for row in rows_of(name, Path(folder))]
    print(markdown([["scene", "file", "MB", "write, s", "read, s", "PSNR, dB"], *rows]))


if __name__ == "__main__":
    main()
