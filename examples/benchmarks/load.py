"""Loading a large scene against reading its bytes: python -m examples.benchmarks.load [--rows 1500000].

Writes a scene with spherical harmonics of degree 3 to a temporary folder (248 bytes a Gaussian),
checks what is read, then times `np.fromfile` (one copy of the numbers as they lie in the file) and
`load` in turn, and measures the peak memory of a process that does nothing but load.
"""

import argparse
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from brushgs.formats import read_scene
from tests.io.ply_maker import decoded, scene_columns

BLOCK = 50_000
# Of the process alone: getrusage would count what the parent had at the time of the fork.
CHILD = """
import re, sys
from pathlib import Path
from brushgs.formats import load
peak = lambda: int(re.search(r"VmHWM:\\s*(\\d+)", Path("/proc/self/status").read_text())[1])
before = peak()
load(sys.argv[1])
print(before, peak())
"""


def write_large(path: Path, num_rows: int) -> tuple[list[str], int]:
    """A scene of random Gaussians; returns the names of its properties and where its rows begin."""
    names = list(scene_columns(1, degree=3))
    lines = "".join(f"property float {name}\n" for name in names)
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {num_rows}\n{lines}end_header\n".encode()
    rng = np.random.default_rng([20250612, num_rows])
    with path.open("wb") as file:
        file.write(header)
        for start in range(0, num_rows, BLOCK):
            rows = rng.standard_normal((min(BLOCK, num_rows - start), len(names)), dtype=np.float32)
            rows[:, names.index("scale_0") : names.index("scale_2") + 1] -= 4
            file.write(rows.tobytes())
    return names, len(header)


def verify(path: Path, names: list[str], offset: int) -> None:
    """Refuse to time a wrong result: first, middle and last block against the definition."""
    gaussians, notes = read_scene(path)
    rows = np.memmap(path, "<f4", "r", offset=offset).reshape(-1, len(names))
    assert len(gaussians) == len(rows)
    assert notes.sh_degree_used == 3
    for start in (0, len(rows) // 2, len(rows) - 1000):
        part = slice(start, start + 1000)
        for name, values in decoded(dict(zip(names, rows[part].T, strict=True))).items():
            np.testing.assert_allclose(getattr(gaussians, name)[part], values, rtol=1e-6, err_msg=name)


def timed(call: Callable[[], object]) -> float:
    start = time.perf_counter()
    result = call()
    seconds = time.perf_counter() - start
    del result
    return seconds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=1_500_000)
    parser.add_argument("--repeats", type=int, default=9)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "large.ply"
        names, offset = write_large(path, options.rows)
        verify(path, names, offset)
        calls = {
            "np.fromfile": lambda: np.fromfile(path, "<f4", offset=offset).reshape(-1, len(names)),
            "load": lambda: read_scene(path),
        }
        seconds: dict[str, list[float]] = {name: [] for name in calls}
        for _ in range(options.repeats):
            for name, call in calls.items():
                seconds[name].append(timed(call))
        child = subprocess.run(
            [sys.executable, "-c", CHILD, str(path)], capture_output=True, text=True, check=True
        )
        before, peak = map(int, child.stdout.split())
        size = path.stat().st_size
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True
    ).stdout.strip()
    print(
        f"commit {commit}, numpy {np.__version__}, {platform.machine()}, {len(os.sched_getaffinity(0))} cores"
    )
    conditions = f"{size / 1e6:.0f} MB, warm page cache, {options.repeats} runs in turn"
    print(f"{options.rows} Gaussians, degree 3, {conditions}")
    for name, values in seconds.items():
        print(f"{name:12} median {statistics.median(values):.3f} s ({min(values):.3f}-{max(values):.3f})")
    ratio = statistics.median(a / b for a, b in zip(seconds["load"], seconds["np.fromfile"], strict=True))
    print(f"load / np.fromfile, median of the ratios: {ratio:.2f}")
    print(
        f"peak memory {peak * 1024 / size:.2f} x the file ({peak / 1024:.0f} MiB, {before / 1024:.0f} before)"
    )


if __name__ == "__main__":
    main()
