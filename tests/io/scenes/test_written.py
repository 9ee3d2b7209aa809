"""Every format that is written: what comes back, from our readers and from an outside one."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import brushgs as bg
from brushgs import Gaussians
from brushgs.formats import read_scene
from brushgs.formats.registry import SCENE_SUFFIXES
from brushgs.formats.scenes.write import write_scene
from brushgs.pipeline.report import Report
from brushgs.pipeline.strokes import write_scene as write_reported
from brushgs.values.camera import FirstView
from tests.io.scenes.witness import as_gaussforge_reads
from tests.io.test_write_ply import CENTERS, LARGEST, OPACITIES, QUATS, SCALES
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse

# Those of USD differ in what packs the same stage, and each file starts a process: some stand for all.
EACH = [suffix for suffix in SCENE_SUFFIXES if suffix not in (".usda", ".usdc")]
QUICK = [suffix for suffix in SCENE_SUFFIXES if not suffix.startswith(".usd")]
WITNESSED = (".splat", ".compressed.ply", ".spz", ".sog")


def make(num_rows: int, num_terms: int = 1, seed: int = 0) -> Gaussians:
    """A scene as trainers make them: within a few units, colors of about 0 to 1."""
    rng = np.random.default_rng([20261122, seed])
    sh = rng.normal(size=(num_rows, num_terms, 3)) * 0.1
    sh[:, 0] = rng.uniform(-1.7, 1.7, size=(num_rows, 3))
    means, quats = rng.normal(size=(num_rows, 3)) * 3, rng.normal(size=(num_rows, 4))
    scales, opacities = np.exp(rng.normal(-4, 1, size=(num_rows, 3))), rng.random(num_rows)
    return Gaussians(means, quats, scales, opacities, sh).astype(np.float32)


def paired(found: Gaussians, written: Gaussians) -> Gaussians:
    """`written` in the order of `found`: some formats sort rows. Each row goes to the nearest center."""
    from scipy.spatial import cKDTree

    rows = cKDTree(written.means).query(found.means)[1]
    assert sorted(rows) == list(range(len(written)))
    return written.take(rows)


def degrees_between(first: Gaussians, second: Gaussians) -> np.ndarray:
    a, b = (s.quats.astype(float) for s in (first, second))
    a, b = (q / np.linalg.norm(q, axis=1, keepdims=True) for q in (a, b))
    return np.degrees(2 * np.arccos(np.minimum(np.abs((a * b).sum(axis=1)), 1)))


# Largest errors that the layout allows: centers (units, of a scene 25 across), log-scales, degrees,
# opacities, coefficients of degree 0, and of the higher degrees.
BOUNDS = {
    ".splat": (0, 1e-5, 0.9, 0.51 / 255, 0.51 / 255 / 0.2820948, 0),
    ".compressed.ply": (25 / 1023, 8 / 1023, 0.3, 0.51 / 255, 1 / 255 / 0.2820948, 0.51 * 8 / 256),
    ".spz": (0.51 / 4096, 0.51 / 16, 0.3, 0.51 / 255, 0.51 / 255 / 0.15, 0.51 / 128),
    ".sog": (1e-3, 0.7, 1.1, 0.51 / 255, 0.02, 0.03),  # rare values, and small sizes, lie farther off
    ".glb": (0, 1e-5, 1e-4, 1e-6, 0, 0),
    ".usd": (0, 1e-5, 1e-4, 1e-6, 0, 0),
    ".usdz": (0, 1e-5, 1e-4, 1e-6, 0, 0),
}


def assert_close(found: Gaussians, written: Gaussians, suffix: str) -> None:
    means, scales, degrees, opacities, colors, rest = BOUNDS[suffix]
    assert np.abs(found.means - written.means).max() <= means
    assert np.abs(np.log(found.scales) - np.log(written.scales)).max() <= scales
    assert degrees_between(found, written).max() <= degrees
    assert np.abs(found.opacities - written.opacities).max() <= opacities
    seen = written.opacities >= 0.5 / 255
    assert np.abs(found.sh[:, 0] - written.sh[:, 0])[seen].max() <= colors
    if suffix != ".splat":
        assert found.sh.shape == written.sh.shape
        assert np.abs(found.sh[:, 1:] - written.sh[:, 1:]).max(initial=0) <= rest


@pytest.mark.filterwarnings("ignore:.*a .splat file does not hold")
@for_each("num_terms", [1, 4, 16])
@for_each("suffix", BOUNDS)
def test_what_is_written_reads_back_to_the_error_of_its_rounding(tmp_path, suffix, num_terms):
    written = make(500, num_terms)
    bg.save(written, tmp_path / f"a{suffix}")
    found = bg.load(tmp_path / f"a{suffix}")
    assert_close(found, paired(found, written), suffix)
    if suffix in WITNESSED:
        data = (tmp_path / f"a{suffix}").read_bytes()
        found = as_gaussforge_reads(data, suffix[1:], tmp_path)
        assert_close(found, paired(found, written), suffix)


@for_each("suffix", EACH)
def test_equal_scenes_give_equal_bytes_and_failures_leave_what_was_there(tmp_path, suffix):
    first, second = tmp_path / f"a{suffix}", tmp_path / f"b{suffix}"
    for path in (first, second):
        bg.save(make(300), path)
    before = first.read_bytes()
    assert before == second.read_bytes()
    second.unlink()
    with pytest.raises(ValueError, match="save: gaussians must have at least one row, got 0"):
        bg.save(make(2).take(slice(0, 0)), second)
    replace = Path.replace

    def fails(self, target):
        if target != first.resolve():  # a temporary file
            return replace(self, target)
        raise OSError(28, "No space left on device")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Path, "replace", fails)
        sentence = r"cannot be written \(No space left on device\); check the disk"
        refuse(first, sentence, lambda path: bg.save(make(10), path))
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [before]
    first.unlink()


coefficients, scales = [st.floats(-4, 4, width=32)] * 3, st.sampled_from([0.0, 1e-30, 1e20]) | SCALES
rows = st.tuples(CENTERS, QUATS, st.tuples(*[scales] * 3), OPACITIES, st.tuples(*coefficients))
ORIGIN = (0.0, 0.0, 0.0)
HUGE = (LARGEST, 1e20, 1e-44)


@pytest.mark.parametrize("suffix", QUICK)
@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(rows, min_size=1, max_size=5))
@example([(ORIGIN, (0, 0, 0, 1e-45), HUGE, 1.0, ORIGIN)])
@example([(ORIGIN, (-1, 0, 0, 0), ORIGIN, 0.0, (90.0, -90.0, 0.0))])
@example([((1e6, 0, 0), (0, -3, 0, 0), (1, 1, 1), 0.5, ORIGIN), ((-1e6,) * 3, (1,) * 4, ORIGIN, 1, ORIGIN)])
def test_any_scene_is_read_back_with_all_of_its_rows(tmp_path, suffix, scene):
    *columns, colors = (np.array(column, np.float32) for column in zip(*scene, strict=True))
    written = Gaussians(*columns, colors[:, None])
    write_scene(written, tmp_path / f"a{suffix}", measures=True)
    found, notes = read_scene(tmp_path / f"a{suffix}")
    assert notes.rows_dropped == 0
    # Opacities of 0 and 1 are exact in every format.
    for exact in (0.0, 1.0):
        assert (found.opacities == exact).sum() >= (written.opacities == exact).sum()


VIEW = FirstView(np.arange(12.0).reshape(4, 3), np.array([0.6, -0.8, 0.0]), 1 / 3, -0.1)
RECORDING = [suffix for suffix in EACH if suffix != ".splat"]


@for_each("num_rows", [1, 700])
@for_each("suffix", RECORDING)
def test_strokes_keep_what_is_recorded_of_them(tmp_path, suffix, num_rows):
    brushes = np.random.default_rng(0).integers(0, 3, num_rows).astype(np.uint8)
    brushes[brushes == 1] = 2  # one has none
    strokes = replace(make(num_rows), brushes=brushes, antialiased=True)
    path = tmp_path / f"a{suffix}"
    names = ("flat", "dab", "swirl", "wash")
    write_scene(strokes, path, is_strokes=True, scene="Käfer", first_view=VIEW, brushes=names)
    found, notes = read_scene(path)
    assert (notes.is_strokes, notes.scene, notes.brushes) == (True, "Käfer", names)
    assert (notes.training, found.antialiased) == ("antialiased", True)
    np.testing.assert_array_equal(notes.first_view.points, VIEW.points)
    np.testing.assert_array_equal(notes.first_view.up, VIEW.up)
    assert found.brushes.tolist() == strokes.brushes.tolist(), "in their order, by which colors are broken"
    np.testing.assert_allclose(found.means, strokes.means, atol=0.03)
    assert notes.unknown == ()


def test_a_centre_too_far_for_spz_is_refused_and_others_get_the_bits_that_fit(tmp_path):
    near = make(50)
    means = near.means.copy()
    means[0] = 5000
    bg.save(replace(near, means=means), tmp_path / "a.spz")
    found = bg.load(tmp_path / "a.spz")
    assert 0.25 / 1024 < np.abs(found.means - means).max() <= 0.5 / 1024
    means[0, 1] = -9e6
    with pytest.raises(ValueError, match="means must lie within 8,388,607 units in an SPZ file, got 9e"):
        bg.save(replace(near, means=means), tmp_path / "b.spz")


@for_each("suffix", WITNESSED)
def test_the_report_tells_what_rounding_changed(tmp_path, suffix):
    scene = make(500)
    report = Report()
    write_reported(scene, tmp_path / f"a{suffix}", report)
    (stage,) = report.stages
    found = bg.load(tmp_path / f"a{suffix}")
    there = paired(found, scene)
    distances, degrees = np.linalg.norm(found.means - there.means, axis=1), degrees_between(found, there)
    assert stage.counts["means_error_most"] == pytest.approx(distances.max(), rel=2e-3, abs=1e-12)
    assert stage.counts["means_error"] == pytest.approx(np.median(distances), rel=2e-3, abs=1e-12)
    assert stage.counts["quats_error_most"] == pytest.approx(degrees.max(), rel=2e-2)
    assert stage.counts["harmonics_error_most"] == 0
    assert [line.split(" are ")[0] for line in stage.details] == ["centers", "sizes", "opacities"]
