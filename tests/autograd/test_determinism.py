"""Gradients do not depend on threads or on the instruction set of the processor. No torch."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from brushgs import _core
from brushgs.rendering.backward import BOX_COLUMNS, GAUSSIAN_COLUMNS, FrameGradients, rasterize_backward
from brushgs.rendering.rasterize import RasterOptions, rasterize
from tests.rendering.strokes import PATHS, random_boxes, texture_of
from tests.rendering.test_project_backward import backward, directions, scene_of

SIZE = {"width": 201, "height": 97}


def all_gradients() -> dict[str, np.ndarray]:
    """Every kernel and filter, every lock, both scalars."""
    found = {}
    g = np.random.default_rng(1)
    for dtype in (np.float32, np.float64):
        v_rgb, v_alpha, v_depth = (
            g.normal(size=shape).astype(dtype) for shape in ((97, 201, 3), (97, 201), (97, 201))
        )
        v = v_rgb, v_alpha, {"depth": v_depth}
        for path, (kind, filter) in PATHS.items():
            boxes, texture = random_boxes(400, **SIZE, seed=6, dtype=dtype), texture_of(kind)
            frame = rasterize(boxes, texture, filter=filter, **SIZE)
            result = rasterize_backward(
                *(boxes, texture, frame, FrameGradients(*v), RasterOptions(**SIZE, filter=filter)),
                with_coverage=kind == "image",
            )
            for name in (*BOX_COLUMNS, *(["coverage"] if kind == "image" else [])):
                found[f"{path} {dtype.__name__} {name}"] = getattr(result, name)
        for lock in ("off", "anchor", directions(500)):
            result = backward(scene_of(500, 3, dtype=dtype), lock=lock, fade=True)
            for name in GAUSSIAN_COLUMNS:
                key = f"{lock if isinstance(lock, str) else 'given'} {dtype.__name__} {name}"
                found[key] = getattr(result, name)
    return found


_SAVE = """
import sys
import numpy as np
from brushgs import _core
from tests.autograd.test_determinism import all_gradients
np.savez(sys.argv[1], isa=_core.isa(), **all_gradients())
"""


def test_every_instruction_set_gives_the_same_bits(tmp_path):
    """Sixteen lanes are added in one order, however many a vector has, and no multiply-add is fused."""
    if _core.isas() == ["baseline"]:
        pytest.skip("the core has one instruction set only, or this processor has")
    results = {}
    for isa in _core.isas():
        file = tmp_path / f"{isa}.npz"
        environment = {**os.environ, "BRUSHGS_ISA": isa, "PYTHONPATH": os.pathsep.join(sys.path)}
        root = Path(__file__).parents[2]
        subprocess.run([sys.executable, "-c", _SAVE, str(file)], env=environment, cwd=root, check=True)
        with np.load(file) as arrays:
            results[str(arrays["isa"])] = {name: arrays[name] for name in arrays.files if name != "isa"}
    assert list(results) == _core.isas()
    for isa, gradients in results.items():
        for name, expected in results["baseline"].items():
            np.testing.assert_array_equal(gradients[name], expected, err_msg=f"{isa} {name}")
