"""Too little memory ends in a MemoryError of the caller, not in the end of the process."""

import subprocess
import sys

SCRIPT = """
import resource
import numpy as np
from brushgs.rendering.rasterize import rasterize
from brushgs.values.boxes import Boxes
from brushgs.brushes.texture import StrokeTexture

n = 20_000  # enough for the threads of the tile lists; all boxes cover all 8192 tiles
f = np.float32
boxes = Boxes(
    np.full((n, 2), 1024, f), np.full((n, 2), 5000, f), np.full(n, 0.3, f), np.arange(n, dtype=f),
    np.ones((n, 3), f), np.ones(n, f), np.arange(n, dtype=np.int32),
)
rasterize(boxes, StrokeTexture.open("gaussian"), height=64, width=64, num_threads=2)
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + 300_000_000, -1))
try:
    rasterize(boxes, StrokeTexture.open("gaussian"), height=2048, width=2048, num_threads=2)
except MemoryError:
    print("told")
"""


def test_tile_lists_beyond_memory_are_told():
    run = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=False)
    assert run.stdout == "told\n", run.stderr
