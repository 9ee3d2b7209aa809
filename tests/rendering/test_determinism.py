"""Pictures do not depend on threads, on what else runs, or on the instruction set of the processor."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import lru_cache
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest

from brushgs import _core
from brushgs.rendering.rasterize import rasterize
from brushgs.rendering.underpaint import Underpaint
from brushgs.values.frame import Frame
from tests.kit.for_each import for_each
from tests.rendering.strokes import (
    PATHS,
    depth_test_of,
    random_boxes,
    relieved,
    ridges,
    set_back,
    softened,
    texture_of,
)

SIZE = {"width": 201, "height": 97}
IMAGES = [path for path, (kind, _) in PATHS.items() if kind == "image"]
LOOKS = {
    "underpainted": {"underpaint": Underpaint(1.8)},
    "streaked": {"streaks": 0.3},
    "layered": {"underpaint": Underpaint(1.8), "streaks": 0.3},
    "glazed": {"blend": "glaze"},
    "raised": {"relief": True},
    "raised layered": {"underpaint": Underpaint(1.8), "streaks": 0.3, "relief": True},
}
HOW = ["soft", *LOOKS, *(f"soft {look}" for look in LOOKS)]
HOW += ["cut", "cut soft", "cut layered", "cut soft layered", "cut glazed", "cut raised", "cut soft raised"]
ALL_PATHS = [
    *PATHS,
    *(f"{how} {path}" for how in HOW for path in IMAGES),
    "raised gaussian",
    "raised ellipse",
]


@lru_cache(2 * len(PATHS))
def drawn(path: str, dtype, n: int):
    """Boxes, texture and options of a path, made once for all numbers of threads."""
    *how, name = path.split()
    kind, filter = PATHS[name]
    boxes = set_back(random_boxes(n, **SIZE, seed=6, sizes=(0.3, 15), dtype=dtype), 0.5)
    if "soft" in how:
        boxes = softened(boxes, 0.2)
    look = LOOKS.get(" ".join(word for word in how if word not in ("soft", "cut")), {})
    texture = texture_of(kind)
    if "raised" in how:
        boxes, texture = relieved(boxes), ridges() if kind == "image" else texture
    test = depth_test_of(boxes, **SIZE) if "cut" in how else None
    return boxes, texture, {"filter": filter, "in_front_of": test, **look}


def frame_of(path: str, dtype, *, n: int = 5000, **options) -> Frame:
    boxes, texture, how = drawn(path, dtype, n)
    return rasterize(boxes, texture, **SIZE, **how, **options)


def assert_identical(actual: Frame, expected: Frame) -> None:
    for name in ("rgb", "alpha", "depth", "height"):
        np.testing.assert_array_equal(getattr(actual, name), getattr(expected, name), err_msg=name)


@for_each(("path", "dtype"), zip(ALL_PATHS, cycle((np.float32, np.float64)), strict=False))
def test_any_number_of_threads_gives_the_same_bits(path, dtype):
    """In one dtype or the other by turns; instruction sets are compared in both."""
    one = frame_of(path, dtype, num_threads=1)
    for num_threads in (3, 40):
        assert_identical(frame_of(path, dtype, num_threads=num_threads), one)


@pytest.mark.parametrize("n", [3999, 4000])
def test_parallel_binning_changes_no_bit(n):
    """From 4000 boxes on, lists are made by several threads."""
    assert_identical(frame_of("mip", np.float32, n=n), frame_of("mip", np.float32, n=n, num_threads=1))


def test_calls_side_by_side_do_not_disturb_each_other():
    expected = {path: frame_of(path, np.float32, num_threads=1) for path in ALL_PATHS}
    with ThreadPoolExecutor(4) as pool:
        paths = ALL_PATHS * 2
        for path, frame in zip(paths, pool.map(lambda p: frame_of(p, np.float32), paths), strict=True):
            assert_identical(frame, expected[path])


def test_a_frame_stays_as_it_is_when_the_next_is_painted():
    """The core keeps frame memory for the next picture; it must not take it from one that is still held."""
    frame = frame_of("mip", np.float32)
    kept = Frame(frame.rgb.copy(), frame.alpha.copy(), frame.depth.copy())
    rgb = frame.rgb[10:20]
    for path in PATHS:
        frame_of(path, np.float32)
    assert_identical(frame, kept)
    del frame
    frame_of("ellipse", np.float32)
    np.testing.assert_array_equal(rgb, kept.rgb[10:20])


def test_boxes_in_front_decide_alone_where_they_are_opaque():
    """Boxes behind a finished picture change no bit, however many."""
    boxes = random_boxes(5000, **SIZE, seed=6, sizes=(5, 40))
    boxes = replace(boxes, opacities=np.where(np.arange(5000) < 4000, 0.999, 0.5))
    texture = texture_of("ellipse")
    all_of_them = rasterize(boxes, texture, **SIZE)
    assert all_of_them.alpha.min() > 1 - 1e-3
    assert_identical(rasterize(boxes.take(np.s_[:4000]), texture, **SIZE), all_of_them)


# Instruction sets: chosen once per process, so each paints in a process of its own.

_PAINT = """
import sys
import numpy as np
from brushgs import _core
from brushgs.rendering.light import light
from tests.rendering.test_determinism import ALL_PATHS, frame_of
planes = {}
for path in ALL_PATHS:
    for dtype in (np.float32, np.float64):
        frame = frame_of(path, dtype)
        depth = np.zeros_like(frame.alpha) if frame.depth is None else frame.depth
        height = [] if frame.height is None else [frame.height]
        planes[f"{path} {dtype.__name__}"] = np.dstack([frame.rgb, frame.alpha, depth, *height])
        if frame.height is not None:
            planes[f"{path} {dtype.__name__} lit"] = light(frame.rgb, frame.height, alpha=frame.alpha)
np.savez(sys.argv[1], isa=_core.isa(), **planes)
"""


@pytest.fixture(scope="module")
def pictures(tmp_path_factory) -> dict[str, dict[str, np.ndarray]]:
    """Instruction set -> path and dtype -> [H, W, 5 or 6] rgb, alpha, depth, height; only those at hand."""
    folder = tmp_path_factory.mktemp("isa")
    result = {}
    for isa in ("baseline", "avx2", "avx512"):
        file = folder / f"{isa}.npz"
        environment = {**os.environ, "BRUSHGS_ISA": isa, "PYTHONPATH": os.pathsep.join(sys.path)}
        subprocess.run(
            [sys.executable, "-c", _PAINT, str(file)],
            env=environment,
            cwd=Path(__file__).parents[2],
            check=True,
        )
        with np.load(file) as planes:
            result[str(planes["isa"])] = {name: planes[name] for name in planes.files if name != "isa"}
    assert "baseline" in result
    if _core.isa() == "baseline":
        pytest.skip("this processor has one instruction set only")
    return result


def test_every_instruction_set_gives_the_same_bits(pictures):
    """No multiply-add is fused anywhere: all of them round alike."""
    for isa, planes in pictures.items():
        for name, expected in pictures["baseline"].items():
            np.testing.assert_array_equal(planes[name], expected, err_msg=f"{isa} {name}")
