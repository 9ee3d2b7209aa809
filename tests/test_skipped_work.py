"""Work that a scene does not need is skipped, and no picture shows it: each shortcut is tested on and off."""

import json

import numpy as np
import pytest
from scipy.linalg import solveh_banded
from scipy.spatial import cKDTree

import brushgs as bg
from brushgs import _core
from brushgs.brushes import levels
from brushgs.options.painting import (
    ClusterConfig,
    DrawConfig,
    PaintConfig,
    PruneConfig,
    StrokesConfig,
    ViewConfig,
)
from brushgs.options.sequence import PathConfig
from brushgs.pipeline import sequence as sequence_stages
from brushgs.pipeline.report import Report
from brushgs.pipeline.sequence import paint_sequence
from brushgs.pipeline.still import paint
from brushgs.values.gaussians import Gaussians
from tests.kit.for_each import for_each
from tests.kit.shortcuts import Painting, difference, shortcuts
from tests.scenes import still_life_of

NAMES = [
    "choosing, where all are kept",
    "merging, where no Gaussian has company",
    "what is visible, known from clustering",
    "assigning anew what the start assigned",
    "SH bands that are zero",
    "strokes outside the picture",
    "strokes of opacity under 1/255",
    "mip levels of no stroke's size",
    "filtering along u again",
    "depth",
    "softness, where the order is by depth",
    "the second thread, 64 x 64, 250 strokes",
    "seven of eight threads, the same",
    "floats between picture and bytes",
    "following directions of a kernel",
    "a frame while the camera rests",
]


@pytest.fixture(scope="module")
def scene():
    """A still life, every seventh Gaussian of which is too faint to be seen."""
    whole = still_life_of(3000)
    opacities = whole.opacities.copy()
    opacities[::7] = 0.003
    return Gaussians(whole.means, whole.quats, whole.scales, opacities, whole.sh)


@pytest.fixture(scope="module")
def found(scene):
    return {shortcut.name: shortcut for shortcut in shortcuts(Painting.of(scene, 400, 96, 72, zoom=2.5))}


def stage(report, name):
    (one,) = [stage for stage in report.stages if stage.name == name]
    return one


def test_all_shortcuts_are_held_to_their_bounds_here(found):
    assert set(found) - {"strokes behind a finished pixel"} == set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_leaving_it_out_changes_nothing(found, name):
    """Bit for bit: no bound but 0 is stated."""
    shortcut = found[name]
    assert shortcut.bound == 0
    outcome = shortcut.on()
    assert any(array.any() for array in outcome)
    assert difference(outcome, shortcut.off()) == 0
    if shortcut.count[1]:
        assert 0 < shortcut.count[0] < shortcut.count[1], "nothing was skipped, so the test shows nothing"


def test_strokes_behind_a_finished_pixel_add_less_than_is_stated(found):
    shortcut = found["strokes behind a finished pixel"]
    assert 0 < difference(shortcut.on(), shortcut.off()) <= shortcut.bound


@for_each("dimensions", [1, 2, 3, 4, 7, 9, 16])
@for_each("num_centers", [1, 2, 9, 700])
def test_the_nearest_centre_is_that_of_scipy(dimensions, num_centers):
    random = np.random.default_rng([dimensions, num_centers])
    points = random.normal(size=(3000, dimensions)).astype(np.float32)
    centers = random.normal(size=(num_centers, dimensions)) * np.linspace(0.01, 2, dimensions)
    distances, rows = _core.nearest(points, centers, 2)
    expected, expected_rows = cKDTree(centers).query(points)
    np.testing.assert_array_equal(distances, expected)
    np.testing.assert_array_equal(rows, expected_rows)


def level_weights(num_source, level):
    """The weights of a level by its definition: the projection of pixel means on hat functions."""
    axis = levels.axis_levels(num_source)[level]
    last, steps = num_source - 1, axis.num_texels - 1
    spacing = last * axis.scale / steps
    centers = (np.arange(axis.num_texels) - steps / 2) * spacing + last / 2
    texels = np.arange(num_source)

    def integral(x):  # of the hat function of each texel, clipped at the ends of the box
        inside = np.clip(np.clip(x, 0, last)[:, None] - texels, -1, 1)
        return 0.5 + inside - 0.5 * inside * np.abs(inside)

    moments = np.zeros((axis.num_texels, num_source))
    for offset in (np.arange(8) - 3.5) / 4:
        places = centers + offset * spacing
        means = integral(places + axis.footprint / 2) - integral(places - axis.footprint / 2)
        means[0 if offset < 0 else -1] = 0
        moments += (1 - abs(offset)) / 4 * means / axis.footprint
    gram = np.full((2, axis.num_texels), 2 / 3)
    gram[1], gram[0, [0, -1]] = 1 / 6, 1 / 3
    return solveh_banded(gram, moments, lower=True)


@for_each(("num_source", "level"), [(256, 1), (256, 7), (97, 4), (13, 3), (2, 1)])
def test_filters_are_those_of_scipy(num_source, level):
    made, expected = levels._level_filter(num_source, level), level_weights(num_source, level)
    np.testing.assert_allclose(made.weights(), expected, rtol=0, atol=1.01e-6)  # smaller ones are left out
    np.testing.assert_array_equal(made.weights()[np.abs(expected) < 0.99e-6], 0)
    texels = np.random.default_rng(0).normal(size=(num_source, 21))
    result = np.empty((len(expected), 21))
    made.apply(texels=texels, result=result)
    np.testing.assert_allclose(result, made.weights() @ texels, rtol=0, atol=1e-13)


def test_the_report_lists_what_was_skipped(scene):
    report, flat = Report(), scene.sh.copy()
    flat[:, 4:] = 0
    flat = Gaussians(scene.means, scene.quats, scene.scales, scene.opacities, flat)
    config = PaintConfig(
        prune=PruneConfig(keep=1.0),
        cluster=ClusterConfig(strokes=None),
        draw=DrawConfig(stroke="gaussian"),
        view=ViewConfig(size=(64, 48), zoom=4.0),
        strokes=StrokesConfig.off(),
    )
    paint(flat, config, report=report)
    assert stage(report, "prune").skipped == ["pruning: keep = 1"]
    assert stage(report, "cluster").skipped == [
        "clustering: every Gaussian is a stroke",
        "solid, direction, repaint, broken colour: they are switched off",
    ]
    project = stage(report, "project")
    assert "no lock, fading or soft order: a kernel fills the ellipse itself" in project.details
    assert "SH degrees 2 to 3 skipped: zero in every row" in project.details
    for words in ("strokes outside the picture", "strokes with an opacity under 1/255"):
        assert any(words in line for line in project.skipped), words
    assert stage(report, "rasterise").details == ["no texture filter: a kernel is computed, not sampled"]
    report = Report()
    paint(
        flat, PaintConfig(view=ViewConfig(size=(64, 48)), cluster=ClusterConfig(strokes=200)), report=report
    )
    assert any("mip levels" in line for line in stage(report, "rasterise").details)
    assert not any("lock" in line for line in stage(report, "project").details)


@pytest.fixture
def resting(tmp_path):
    """A camera that stays, moves, and comes back: views 0 0 0 1 1 0."""
    here, there = (
        {
            "width": 48,
            "height": 32,
            "position": [x, -2, -12],
            "rotation": np.eye(3).tolist(),
            "fx": 40,
            "fy": 40,
        }
        for x in (0.3, 0.5)
    )
    views = [here, here, here, there, there, here]
    path = tmp_path / "cameras.json"
    path.write_text(json.dumps([view | {"id": i, "img_name": str(i)} for i, view in enumerate(views)]))
    return path


@pytest.mark.parametrize("lock", ["track", "anchor"])
def test_a_resting_camera_is_painted_once_to_the_byte(scene, resting, tmp_path, monkeypatch, lock):
    bg.save(scene, tmp_path / "scene.ply")
    config = PaintConfig(cluster=ClusterConfig(strokes=100), draw=DrawConfig(stroke="flat", lock=lock))

    def painted(folder):
        report = paint_sequence(tmp_path / "scene.ply", tmp_path / folder, PathConfig(file=resting), config)
        files = sorted((tmp_path / folder).glob("*.png"))
        return [file.read_bytes() for file in files], stage(report, "paint")

    files, told = painted("once")
    assert told.counts["painted"] == 3
    assert told.counts["repeated"] == 3
    assert told.counts["skipped"] == 0
    assert told.skipped == ["3 frames: the camera rests, they equal those before"]
    assert files[0] != files[3]
    monkeypatch.setattr(sequence_stages._Frames, "identity", lambda self, index: (index,))
    every, told = painted("every")
    assert told.counts["painted"] == 6
    assert not told.skipped
    assert files == every
