"""Work that a scene does not need is skipped, and no picture shows it: each shortcut is tested on and off."""

import json

import numpy as np
import pytest
from scipy.linalg import solveh_banded
from scipy.spatial import cKDTree

import brushgs as bg
from brushgs import _core
from brushgs.brushes import levels
from brushgs.core.threads import at_most
from brushgs.formats.pictures.oiio import quantise
from brushgs.options.painting import (
    ClusterConfig,
    DrawConfig,
    PaintConfig,
    PruneConfig,
    StrokesConfig,
    ViewConfig,
)
from brushgs.options.sequence import PathConfig
from brushgs.passes.reduce import contribution, lloyd
from brushgs.passes.reduce.cluster import group
from brushgs.passes.reduce.features import cluster_features
from brushgs.passes.reduce.merge import merge_clusters
from brushgs.pipeline import sequence as sequence_stages
from brushgs.pipeline.report import Report
from brushgs.pipeline.sequence import paint_sequence
from brushgs.pipeline.still import paint
from brushgs.rendering import texture_levels
from brushgs.values.frame import Frame
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


def test_what_is_visible_is_asked_once_in_a_clustering(scene, monkeypatch):
    asked = []

    def counted(gaussians):
        asked.append(len(gaussians))
        return contribution.visible_shares(gaussians)

    for module in ("cluster", "merge"):
        monkeypatch.setattr(f"brushgs.passes.reduce.{module}.visible_shares", counted)
    bg.cluster(scene, 100)
    assert asked == [len(scene)]


def test_what_is_visible_may_come_from_elsewhere_but_must_fit(scene):
    grouping = group(scene, 100, features="paper")
    assert grouping.visible is None
    with pytest.raises(ValueError, match=r"merge_clusters: visible must have shape .*, got \[7\]"):
        merge_clusters(scene, grouping.labels, visible=np.ones(7))


@pytest.mark.parametrize("threads", [1, 2, 4])
def test_visible_shares_do_not_depend_on_threads(scene, monkeypatch, threads):
    expected = contribution.visible_shares(scene)
    monkeypatch.setattr(contribution, "ROWS_PER_THREAD", 10)
    with at_most(threads):
        np.testing.assert_array_equal(contribution.visible_shares(scene), expected)


@pytest.mark.parametrize("num_clusters", [1, 5, 33, 400, 2999])
def test_the_start_knows_what_the_first_step_would_find(scene, num_clusters):
    points = cluster_features(scene)
    centers, distances, nearest = lloyd.start(points, np.ones(len(points)), num_clusters, 3)
    again, rows = lloyd.assign(points, centers)
    np.testing.assert_array_equal(distances, again)
    np.testing.assert_array_equal(nearest, rows)


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


def test_of_equally_near_centres_the_first_is_taken():
    random = np.random.default_rng(0)
    grid = random.integers(0, 3, size=(500, 3)).astype(np.float64)
    points = random.integers(0, 5, size=(2000, 3)).astype(np.float32) / 2
    _, rows = _core.nearest(points, grid, 3)
    squared = ((points[:, None].astype(np.float64) - grid) ** 2).sum(axis=2)
    np.testing.assert_array_equal(rows, squared.argmin(axis=1))


def test_points_far_apart_and_of_no_extent_have_a_nearest_centre():
    points = np.array([[0.0], [3e38], [-3e38], [1e-38]], np.float32)
    distances, rows = _core.nearest(points, np.zeros((40, 1)), 1)
    np.testing.assert_array_equal(rows, 0)
    np.testing.assert_array_equal(distances, np.abs(points[:, 0].astype(np.float64)))
    assert len(_core.nearest(points[:0], np.zeros((1, 1)), 1)[0]) == 0


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


@pytest.mark.parametrize("num_threads", [1, 3])
def test_levels_made_together_are_products_of_matrices(num_threads):
    g = np.random.default_rng(0)
    coverage, height = (g.integers(0, 256, (61, 150)).astype(np.uint8) for _ in range(2))
    coverage[:30, :70] = 0
    codes = [(3, 0), (0, 0), (3, 4), (0, 5), (6, 2)]
    found = levels.stroke_levels(coverage, codes, height, num_threads=num_threads)
    assert found[1][0] is coverage
    assert found[1][1] is height
    for (u, v), (painted, raised) in zip(codes, found, strict=True):
        if (u, v) == (0, 0):
            continue
        along_u, along_v = (
            levels._level_filter(size, level).weights() if level else np.eye(size)
            for size, level in ((150, u), (61, v))
        )
        texels, above = (
            along_v @ image.astype(float) @ along_u.T for image in (coverage, (height - 127.5) * coverage)
        )
        for image, expected in ((painted, texels), (raised, 127.5 + above / np.maximum(texels, 2))):
            difference = image - np.clip(expected, 0, 255)
            assert np.abs(difference).max() < 0.5 + 1e-9
        np.testing.assert_array_equal(levels.level_coverage(coverage, u, v), painted)
        np.testing.assert_array_equal(levels.level_height(height, coverage, u, v), raised)


def test_a_level_made_later_is_the_one_made_with_others():
    texture = bg.StrokeTexture.open("flat")
    together = texture_levels.packed_levels(texture, [(2, 5), (0, 0), (2, 1)])
    for code, level in zip([(2, 5), (0, 0), (2, 1)], together, strict=True):
        texture_levels._cache.pop(texture, None)
        np.testing.assert_array_equal(texture_levels.packed_levels(texture, [code])[0].pairs, level.pairs)


@for_each("dtype", [np.float32, np.float64])
@for_each("ground", ["colour", "picture"])
def test_bytes_are_those_of_rounded_floats(dtype, ground):
    random = np.random.default_rng(0)
    rgb = random.uniform(-0.2, 1.3, (30, 50, 3)).astype(dtype)
    rgb[0] = (np.arange(150).reshape(50, 3) + 0.5) / 255  # halves
    frame = Frame(rgb, random.uniform(0, 1, (30, 50)).astype(dtype))
    frame.alpha[0] = 1
    behind = (0.2, 1.0, 0.7) if ground == "colour" else random.uniform(0, 1, rgb.shape)
    np.testing.assert_array_equal(frame.bytes_over(behind), quantise(frame.over(behind), np.uint8))
    with pytest.raises(ValueError, match="background must have shape"):
        frame.bytes_over((1.0, 1.0))


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
