"""The first yardstick of the raster benchmark, from Python: scanline.cpp, compiled where it is needed."""

import ctypes
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from brushgs.values.boxes import Boxes

FLAGS = ["-O3", "-march=native", "-std=c++20", "-fPIC", "-shared", "-pthread"]
F32 = NDArray[np.float32]
Painter = Callable[[Boxes, NDArray[np.uint8], int, int, int], tuple[F32, F32]]


def load() -> Painter:
    """Compile and load it.

    Returns:
        paint(boxes, coverage, width, height, num_threads) -> premultiplied rgb [H, W, 3] and transmittance
        [H, W]; boxes are float32.

    Raises:
        RuntimeError: if there is no g++ or it fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "scanline.so"
        source = Path(__file__).with_suffix(".cpp")
        try:
            subprocess.run(["g++", *FLAGS, "-o", str(library), str(source)], check=True)
        except (OSError, subprocess.CalledProcessError) as error:
            raise RuntimeError(f"scanline: g++ must be there and compile {source}; {error}") from error
        function = ctypes.CDLL(str(library)).scanline
    function.restype = None

    def pointer(array: NDArray[np.generic]) -> ctypes.c_void_p:
        assert array.flags.c_contiguous
        return ctypes.c_void_p(array.ctypes.data)

    def paint(
        boxes: Boxes, coverage: NDArray[np.uint8], width: int, height: int, num_threads: int
    ) -> tuple[F32, F32]:
        columns = (boxes.centers, boxes.half_extents, boxes.angles, boxes.colors, boxes.opacities)
        assert all(column.dtype == np.float32 for column in columns)
        rgb, transmittance = np.empty((height, width, 3), np.float32), np.empty((height, width), np.float32)
        rows, num_columns = coverage.shape
        sizes = (ctypes.c_int(n) for n in (num_columns, rows, width, height, num_threads))
        function(
            ctypes.c_int(len(boxes)),
            *(pointer(column) for column in columns),
            pointer(coverage),
            *sizes,
            pointer(rgb),
            pointer(transmittance),
        )
        return rgb, transmittance

    return paint
