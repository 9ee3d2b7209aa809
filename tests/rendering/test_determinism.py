"""Pictures do not depend on threads, on what else runs, or on the instruction set of the processor."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from itertools import cycle

import numpy as np
import pytest

from brushgs import _core
from brushgs.values.frame import Frame
from tests.kit.for_each import for_each
from tests.rendering.paintings import LOOKS, assert_identical, painting_of
from tests.rendering.strokes import IMAGES, PATHS

SIZE = {"width": 201, "height": 97}
HOW = [f"{soft}{look}" for soft in ("", "soft=0.2 ") for look in LOOKS]
HOW += [f"cut {how}" for how in HOW if "under" not in how and "streaked" not in how]
ALL_PATHS = [*(f"{how} ridges {path}" for how in HOW for path in IMAGES), "gaussian", "ellipse"]
ALL_PATHS += ["raised gaussian", "raised ellipse", "tinted soft=0.2 layered mip"]


@lru_cache(2 * len(PATHS))
def drawn(path: str, dtype, n: int):
    """A painting, made once for all numbers of threads."""
    return painting_of(path, n, **SIZE, dtype=dtype)


def frame_of(path: str, dtype, *, n: int = 2000, **options) -> Frame:
    return drawn(path, dtype, n).frame(**options)


@for_each(("path", "dtype"), zip(ALL_PATHS, cycle((np.float32, np.float64)), strict=False))
def test_any_number_of_threads_gives_the_same_bits(path, dtype):
    """In one dtype or the other by turns; instruction sets are compared in both."""
    one = frame_of(path, dtype, num_threads=1)
    for num_threads in (3, 40):
        assert_identical(frame_of(path, dtype, num_threads=num_threads), one)


@for_each("n", [3999, 4000])
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


# Instruction sets: chosen once per process, so each paints, projects and follows in a process of its own.

_WORK = """
import hashlib
from dataclasses import fields, replace
import numpy as np
from brushgs import _core
from brushgs.rendering.backward import FrameGradients, rasterize_backward
from brushgs.rendering.light import light
from brushgs.rendering.project import project
from brushgs.rendering.rasterize import RasterOptions
from brushgs.rendering.track import track_directions
from brushgs.rendering.track_moving import track_moving
from tests.rendering import test_track, test_track_moving
from tests.rendering.paintings import LOOKS, relieved, set_back
from tests.rendering.strokes import PATHS
from tests.rendering.test_backward import weights
from tests.rendering.test_determinism import ALL_PATHS, drawn, frame_of
from tests.rendering.test_project import FRONT, random_scene
from tests.rendering.test_project_backward import backward, directions, scene_of
from tests.rendering.test_soft import crowd, painted

def tell(name, *arrays):
    print(name, hashlib.sha256(b"".join(a.tobytes() for a in arrays if a is not None)).hexdigest(), sep=": ")

def columns(value):
    named = (getattr(value, field.name) for field in fields(value))
    return [column for column in named if isinstance(column, np.ndarray)]

print(_core.isa())
for dtype in (np.float32, np.float64):
    for path in ALL_PATHS:
        frame = frame_of(path, dtype, n=1200)
        tell(f"{path} {dtype}", *columns(frame))
        if frame.height is not None:
            tell(f"{path} {dtype} lit", light(frame.rgb, frame.height, alpha=frame.alpha))
    for path, (kind, _) in PATHS.items():
        (boxes, texture, how), v = drawn(path, dtype, 400), FrameGradients(*weights(dtype, (97, 201)))
        frame, is_image = frame_of(path, dtype, n=400), kind == "image"
        found = rasterize_backward(boxes, texture, frame, v, RasterOptions(**how), with_coverage=is_image)
        tell(f"gradients {path} {dtype}", *columns(found), *(found.coverages or ()))
    for name, lock in (("off", "off"), ("anchor", "anchor"), ("given", directions(500))):
        found = backward(scene_of(500, 3, dtype=dtype), lock=lock, fade=True)
        tell(f"gradients {name} {dtype}", *columns(found))
    for look, options in LOOKS.items():
        boxes = crowd(300, opacities=(0.01, 0.4), softness=(0.1, 1), dtype=dtype)
        tell(f"crowd {look} {dtype}", *columns(painted(relieved(set_back(boxes, 0.5)), **options)))
    for is_antialiased in (False, True):
        scene = replace(random_scene(3000, dtype=dtype), antialiased=is_antialiased)
        tell(f"projected {dtype} {is_antialiased}", *columns(project(scene, FRONT)))
    strokes, cameras = test_track.strokes(200, dtype=dtype), test_track.turntable(60, step=np.pi / 30)
    path = track_directions(strokes, test_track.closed(cameras))
    tell(f"followed {dtype}", path.turns, path.area_scales)
    for lock in ("anchor", path.directions(3)):
        tell(f"locked {dtype}", *columns(project(strokes, cameras[0], lock=lock, fade=True)))
    some = test_track_moving.scene(200).astype(dtype)
    for degrees in (3.0, 40.0):
        motion = test_track_moving.tumble(degrees, 200)
        path = track_moving(some, cameras, motion, test_track_moving.EVERY, fps=30).moving
        tell(f"followed {degrees} {dtype}", path.turns, path.area_scales)
"""


def test_every_instruction_set_gives_the_same_bits():
    """No multiply-add is fused anywhere, and lanes are added in one order, however many a vector has."""
    if _core.isas() == ["baseline"]:
        pytest.skip("the core has one instruction set only, or this processor has")
    told = {}
    for isa in _core.isas():
        environment = {**os.environ, "BRUSHGS_ISA": isa, "PYTHONPATH": os.pathsep.join(sys.path)}
        run = [sys.executable, "-c", _WORK]
        found = subprocess.run(run, env=environment, capture_output=True, text=True, check=False)
        assert found.returncode == 0, found.stderr
        name, *told[isa] = found.stdout.splitlines()
        assert name == isa
    for isa, lines in told.items():
        assert len(lines) > 100
        assert [line for line in lines if line not in told["baseline"]] == [], isa
