"""Loading a large SOG scene against decoding its pictures:
`python -m examples.benchmarks.load_sog [--rows 1500000]`.

Writes a synthetic scene with spherical harmonics of degree 3 to a temporary folder and as a zip archive, with
as smooth pictures as a trained scene in the order of its writers has, checks what is read, then times in turn
the decoding of the pictures alone (the floor, with as many threads) and `load` of both. Processor time, which
other programs disturb less, is of all threads together.
"""

import argparse
import statistics
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

import brushgs as bg
from brushgs.core.threads import num_threads_or_default
from brushgs.formats.pictures.images import MAX_PIXELS, read_bytes
from examples.benchmarks import machine
from tests.io.scenes.sog_maker import decode, files_of, make, zipped


def large_scene(num_rows: int) -> dict:
    """A scene of random bytes, smooth where those of trained scenes are: high bytes, scales, colors."""
    scene = make(num_rows, 3, seed=20251121)
    rng = np.random.default_rng(num_rows)
    for name in ("means_u", "scales", "sh0"):
        pixels = scene[name]
        rows = np.arange(pixels.shape[0] * pixels.shape[1]).reshape(*pixels.shape[:2], 1)
        spread = 2 if name == "means_u" else 40
        smooth = 128 + 100 * np.sin(rows / 9000 + np.arange(3))
        pixels[..., :3] = np.clip(smooth + rng.normal(0, spread, (*pixels.shape[:2], 3)), 0, 255)
    # The palette of a large scene is full.
    labels = rng.integers(0, 65536, scene["shN_labels"].shape[:2])
    scene["shN_labels"] = np.stack([labels & 255, labels >> 8, 0 * labels], axis=-1).astype(np.uint8)
    scene["shN_centroids"] = rng.integers(100, 156, (1024, 64 * 15, 3), dtype=np.uint8)
    scene["meta"]["shN"]["count"] = 65536
    return scene


def verify(path: Path, scene: dict, num_rows: int) -> None:
    """Refuse to time a wrong result."""
    gaussians = bg.load(path)
    assert len(gaussians) == num_rows
    for row in (0, num_rows // 2, num_rows - 1):
        for name, (value,) in decode(scene, [row]).items():
            np.testing.assert_allclose(getattr(gaussians, name)[row], value, rtol=2e-6, atol=3e-7)


def timed(call: Callable[[], object]) -> tuple[float, float]:
    """Seconds on the clock and of the processor."""
    clock, processor = time.perf_counter(), time.process_time()
    result = call()
    seconds = time.perf_counter() - clock, time.process_time() - processor
    del result
    return seconds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=1_500_000)
    parser.add_argument("--repeats", type=int, default=7)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "scene"
        folder.mkdir()
        scene = large_scene(options.rows)
        files = files_of(scene)
        for file, content in files.items():
            (folder / file).write_bytes(content)
        bundle = Path(name) / "scene.sog"
        bundle.write_bytes(zipped(files))
        for path in (folder, bundle):
            verify(path, scene, options.rows)
        del scene, files
        pictures = sorted(folder.glob("*.webp"))

        def decode_pictures() -> None:
            with ThreadPoolExecutor(num_threads_or_default(None)) as pool:
                list(pool.map(lambda path: read_bytes(path, MAX_PIXELS), pictures))

        calls = {
            "pictures": decode_pictures,
            "load folder": lambda: bg.load(folder),
            "load archive": lambda: bg.load(bundle),
        }
        seconds: dict[str, list[tuple[float, float]]] = {name: [] for name in calls}
        for _ in range(options.repeats):
            for name, call in calls.items():
                seconds[name].append(timed(call))
        size = bundle.stat().st_size
    print(machine.describe())
    print(f"{options.rows} Gaussians, degree 3, {size / 1e6:.0f} MB, {options.repeats} runs in turn")
    for name, pairs in seconds.items():
        values, processor = zip(*pairs, strict=True)
        spread = f"({min(values):.3f}-{max(values):.3f})"
        print(
            f"{name:12} median {statistics.median(values):.3f} s {spread},"
            f" processor {statistics.median(processor):.3f} s"
        )


if __name__ == "__main__":
    main()
