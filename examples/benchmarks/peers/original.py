"""The published Im2Oil, where the user has a checkout: the same picture, in a process of its own.

Its program takes a picture and a brush, and no number of strokes: how many it lays follows from the picture.
It needs OpenCV and torch, and asks for no weights. Nothing is written into the checkout.
"""

import re
import resource
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import brushgs as bg
from brushgs.formats.pictures.images import read_image, resize
from brushgs.values.arrays import F32
from examples.benchmarks.peers.work import Painted

PROGRAM, BRUSH = "Oil-Painting.py", "brush/brush-0.png"
RESULT = "Final_Result.png"


def check_checkout(folder: Path) -> None:
    """Refuse a folder that is no checkout, before long work.

    Raises:
        ValueError: if the program or its brush is missing.
    """
    for name in (PROGRAM, BRUSH):
        if not (folder / name).is_file():
            raise ValueError(f"im2oil: {folder} has no {name}; name a checkout of Im2Oil")


def paint_original(folder: Path, picture: F32) -> Painted:
    """Run the program on a picture [H, W, 3], 0 to 1.

    Raises:
        ValueError: if it fails or leaves no picture.
    """
    folder = folder.resolve()
    height, width = picture.shape[:2]
    with TemporaryDirectory() as scratch:
        given = Path(scratch) / "view.png"
        bg.save(bg.Frame(picture, np.ones((height, width), np.float32), None), given)
        command = [sys.executable, str(folder / PROGRAM), "--f", str(given), "--b", str(folder / BRUSH)]
        start, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
        run = subprocess.run(command, cwd=scratch, capture_output=True, text=True, check=False)
        seconds, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
        results = sorted(Path(scratch).glob(f"output/*/{RESULT}"))
        if run.returncode or not results:
            last = (run.stderr.strip().splitlines() or ["it left no picture"])[-1]
            raise ValueError(f"im2oil: {folder / PROGRAM} failed ({last}); run it there to see why")
        painted = resize(read_image(results[0])[..., :3], width, height)
    counts = re.findall(r"Stoke number (\d+)", run.stdout)  # the program's own spelling
    eight_bits = (255 * painted + 0.5).astype("uint8")
    # Linux counts in kB the largest of all children so far, which this program is by far.
    memory = after.ru_maxrss / 1024
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Painted((eight_bits,), int(counts[0]) if counts else None, None, memory, processor, seconds)
