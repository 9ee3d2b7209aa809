"""Loading large packed scenes against the floor of each format:
`python -m examples.benchmarks.load_packed [--rows N]`.

Writes random scenes as .splat, .ksplat and SPZ to a temporary folder, checks the first rows against the
decoders of the tests, then times in turn `load` and what no reader can avoid: `np.fromfile` of the file, and
for SPZ decompressing it. Random scenes compress worse than trained ones: positions hardly, all else as far as
the spread of its values allows.
"""

import argparse
import os
import platform
import statistics
import struct
import subprocess
import tempfile
import time
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import zstandard

from brushgs.formats import read_scene
from tests.io.scenes import ksplat_format, splat_format, spz_format

CHECKED = 200  # rows that are compared before anything is timed


def make_blocks(num_rows: int, degree: int) -> list[np.ndarray]:
    """The blocks of an SPZ file with about the entropy of a trained scene."""
    rng = np.random.default_rng([20251126, num_rows])
    words = rng.normal(0, 8000, size=(num_rows, 3)).astype("<i4")
    positions = np.ascontiguousarray(words).view(np.uint8).reshape(num_rows, 3, 4)[:, :, :3]
    quats = rng.integers(0, 2**32, num_rows, dtype=np.uint32)
    rest = rng.normal(128, 12, size=(num_rows, 3 * spz_format.NUM_REST[degree])).astype(np.uint8)
    rest &= 0xF0  # writers keep 4 to 5 bits
    return [
        positions,
        rng.integers(0, 256, num_rows, dtype=np.uint8),
        rng.normal(110, 20, size=(num_rows, 3)).astype(np.uint8),
        rng.normal(90, 20, size=(num_rows, 3)).astype(np.uint8),
        quats,
        rest,
    ]


def write_spz(path: Path, num_rows: int, degree: int, version: int) -> None:
    parts = [np.ascontiguousarray(block).tobytes() for block in make_blocks(num_rows, degree)]
    if version == 4:
        path.write_bytes(spz_format.encode_4(num_rows, degree, parts))
        return
    header = struct.pack("<4sIIBBBB", b"NGSP", version, num_rows, degree, 12, 0, 0)
    packer = zlib.compressobj(wbits=31)
    path.write_bytes(packer.compress(b"".join([header, *parts])) + packer.flush())


def write_splat(path: Path, num_rows: int) -> None:
    rng = np.random.default_rng([20251127, num_rows])
    rows = np.empty((num_rows, 8), "<f4")
    rows[:, :3] = rng.standard_normal((num_rows, 3))
    rows[:, 3:6] = np.exp(rng.normal(-4, 1, size=(num_rows, 3)))
    rows.view(np.uint8)[:, 24:] = rng.integers(0, 256, size=(num_rows, 8))
    rows.tofile(path)


def write_ksplat(path: Path, num_rows: int, degree: int) -> None:
    """Level 1 with full buckets, by repeating the rows of a small file."""
    small = ksplat_format.encode([ksplat_format.make(1600, degree)], 1)
    num_buckets = num_rows // ksplat_format.BUCKET_ROWS
    header = bytearray(small[:5120])
    row_size = 24 + 6 * ksplat_format.NUM_REST[degree]
    struct.pack_into("<2I", header, 12, num_rows, num_rows)
    struct.pack_into("<2I", header, 4096, num_rows, num_rows)
    struct.pack_into("<I", header, 4096 + 12, num_buckets)
    struct.pack_into("<I", header, 4096 + 32, num_buckets)
    centers, rows = small[5120 : 5120 + 1200], small[5120 + 1200 :]
    assert len(rows) == 1600 * row_size
    assert num_rows % 1600 == 0
    path.write_bytes(bytes(header) + centers * (num_rows // 1600) + rows * (num_rows // 1600))


def verify(path: Path, num_rows: int) -> None:
    """Refuse to time a wrong result: the first rows against the decoders of the tests."""
    gaussians, notes = read_scene(path)
    assert notes.rows_read == num_rows
    if path.suffix == ".splat":
        expected = splat_format.decode(path.read_bytes()[: 32 * CHECKED])
        np.testing.assert_allclose(gaussians.scales[:CHECKED], expected["scales"], rtol=2e-6)
    elif path.suffix == ".spz":
        scene = spz_format.decode(path.read_bytes(), CHECKED)
        np.testing.assert_allclose(gaussians.means[:CHECKED], scene["means"], rtol=1e-6)
        np.testing.assert_allclose(gaussians.quats[:CHECKED], scene["quats"], atol=3e-7)
    else:
        assert np.isfinite(gaussians.means).all()


def inflate(path: Path) -> object:
    data = path.read_bytes()
    if data[:2] == b"\x1f\x8b":
        return zlib.decompress(data, wbits=31)
    return [zstandard.ZstdDecompressor().decompress(stream) for stream in spz_format.streams(data)]


def timed(call: Callable[[], object]) -> float:
    start = time.perf_counter()
    result = call()
    seconds = time.perf_counter() - start
    del result
    return seconds


def measure(path: Path, repeats: int) -> None:
    calls: dict[str, Callable[[], object]] = {"np.fromfile": lambda: np.fromfile(path, np.uint8)}
    if path.suffix == ".spz":
        calls["decompress"] = lambda: inflate(path)
    calls["load"] = lambda: read_scene(path)
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(repeats):
        for name, call in calls.items():
            seconds[name].append(timed(call))
    figures = "  ".join(
        f"{name} {statistics.median(values):.3f} s ({min(values):.3f}-{max(values):.3f})"
        for name, values in seconds.items()
    )
    print(f"{path.name:16} {path.stat().st_size / 1e6:6.1f} MB  {figures}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=1_500_000)
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    num_rows = options.rows // 1600 * 1600
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True
    ).stdout.strip()
    cores = len(os.sched_getaffinity(0))
    print(f"commit {commit}, numpy {np.__version__}, zlib {zlib.ZLIB_RUNTIME_VERSION}, {platform.machine()}")
    print(f"{num_rows} Gaussians, warm page cache, {cores} cores, medians of {options.repeats} runs in turn")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        writers: dict[str, Callable[[Path], None]] = {
            "a.splat": lambda path: write_splat(path, num_rows),
            "sh0.ksplat": lambda path: write_ksplat(path, num_rows, 0),
            "sh2.ksplat": lambda path: write_ksplat(path, num_rows, 2),
            "sh0-v3.spz": lambda path: write_spz(path, num_rows, 0, 3),
            "sh3-v3.spz": lambda path: write_spz(path, num_rows, 3, 3),
            "sh0-v4.spz": lambda path: write_spz(path, num_rows, 0, 4),
            "sh3-v4.spz": lambda path: write_spz(path, num_rows, 3, 4),
        }
        for file, write in writers.items():
            path = folder / file
            write(path)
            verify(path, num_rows)
            measure(path, options.repeats)
            path.unlink()


if __name__ == "__main__":
    main()
