from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import brushgs as bg
from brushgs import Gaussians
from brushgs.formats.scenes.write import write_scene
from tests.kit.for_each import for_each
from tests.passes.scenes import random_gaussians

EPS = np.finfo(np.float32).eps


def make(num_rows: int, num_terms: int = 1, seed: int = 0, dtype: type = np.float32) -> Gaussians:
    return random_gaussians(num_rows, seed, terms=num_terms, size=0.02, dtype=dtype)


def assert_same(read: Gaussians, written: Gaussians) -> None:
    """Equal within what float32 logs can tell apart: an error of half an ulp of the log is relative."""
    for name in ("means", "quats", "sh"):
        np.testing.assert_array_equal(getattr(read, name), getattr(written, name), err_msg=name)
    with np.errstate(divide="ignore"):
        logs = np.clip(np.abs(np.log(written.scales.astype(np.float64))), 1, 104)
    error = np.abs(read.scales - written.scales.astype(np.float64))
    assert (error <= 2 * EPS * logs * written.scales + np.finfo(np.float32).smallest_subnormal).all()
    # d opacity = opacity (1 - opacity) d logit <= 0.25 x ulp(logit): below 0.23 x logit x eps near 0.5.
    np.testing.assert_allclose(read.opacities, written.opacities, rtol=0, atol=2 * EPS)


@for_each("num_rows, num_terms", [(1000, 4), (300, 9), (40_000, 16)])  # the last in several blocks
@for_each("dtype", [np.float32, np.float64])
def test_what_is_written_reads_back(tmp_path, num_rows, num_terms, dtype):
    brushes = np.random.default_rng(num_rows).integers(0, 3, num_rows).astype(np.uint8)
    strokes = replace(make(num_rows, num_terms, dtype=dtype), brushes=brushes)
    write_scene(strokes, tmp_path / "a.ply", brushes=("a", "b", "c"))
    read = bg.load(tmp_path / "a.ply")
    np.testing.assert_array_equal(read.brushes, brushes)
    if dtype == np.float32:
        assert_same(read, strokes)


LARGEST = float(np.finfo(np.float32).max)
TINIEST = float(np.finfo(np.float32).smallest_subnormal)
CENTERS = st.tuples(*[st.floats(-1e6, 1e6, width=32)] * 3)
QUATS = st.tuples(*[st.floats(-4, 4, width=32)] * 4).filter(any)
SCALES = st.just(0.0) | st.floats(0, LARGEST, width=32)
OPACITIES = st.sampled_from([0.0, 1.0]) | st.floats(0, 1, width=32)
ROWS = st.tuples(CENTERS, QUATS, st.tuples(*[SCALES] * 3), OPACITIES)


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(ROWS, min_size=1, max_size=5))
@example([((0, 0, 0), (0, 0, 0, TINIEST), (LARGEST, 0, TINIEST), 1.0)])
@example([((0, 0, 0), (1, 0, 0, 0), (1, 1, 1), float(np.nextafter(np.float32(1), 0)))])
@example([((0, 0, 0), (0, 0, 0, 1), (1, 1, 1), 0.5)])  # is no file of decoded values
def test_any_scene_reads_back_and_no_infinity_is_written(tmp_path, scene):
    columns = [np.array(column, dtype=np.float32) for column in zip(*scene, strict=True)]
    gaussians = Gaussians(*columns, np.zeros((len(scene), 1, 3), np.float32))
    bg.save(gaussians, tmp_path / "a.ply")
    stored = np.frombuffer((tmp_path / "a.ply").read_bytes()[-len(scene) * 68 :], "<f4")
    assert np.isfinite(stored).all()
    read = bg.load(tmp_path / "a.ply")
    assert len(read) == len(scene)
    is_huge = gaussians.scales > 3.4e38  # within 0.1 % of the largest float32, whose log was lowered
    np.testing.assert_allclose(read.scales[is_huge], gaussians.scales[is_huge], rtol=1e-3)
    assert ((read.scales == 0) == (gaussians.scales == 0))[gaussians.scales > 1e-40].all()
    huge = np.where(is_huge, 1, gaussians.scales).astype(np.float32)
    with_ones = Gaussians(read.means, read.quats, np.where(is_huge, 1, read.scales), read.opacities, read.sh)
    assert_same(with_ones, Gaussians(*columns[:2], huge, columns[3], gaussians.sh))


def test_what_cannot_be_saved_is_refused_by_name(tmp_path):
    gaussians = make(2, dtype=np.float64)
    big = replace(gaussians, means=gaussians.means * 1e60)
    with pytest.raises(ValueError, match="save: means must fit float32, got larger values; shrink the scene"):
        bg.save(big, tmp_path / "a.ply")
    with pytest.raises(ValueError, match=r"save: Gaussians must go to a \.ply, .*got '.*a\.ksplat'; change"):
        bg.save(make(2), tmp_path / "a.ksplat")
    with pytest.raises(TypeError, match="save: value must be Gaussians or a Frame, got int"):
        bg.save(3, tmp_path / "a.ply")
    assert list(tmp_path.iterdir()) == []
