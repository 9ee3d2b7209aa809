"""Work that a scene does not need is skipped, and no picture shows it: each shortcut beside all the work."""

import json
from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from scipy.linalg import solveh_banded
from scipy.spatial import cKDTree

import brushgs as bg
from brushgs import _core
from brushgs.brushes import levels
from brushgs.cameras.first_view import framed_camera
from brushgs.cameras.framing import plain_first_view
from brushgs.options.painting import ClusterConfig, DrawConfig, PaintConfig, ViewConfig
from brushgs.options.sequence import PathConfig
from brushgs.passes.reduce import contribution
from brushgs.passes.reduce.cluster import group
from brushgs.passes.reduce.merge import merge_clusters
from brushgs.passes.reduce.prune import highest
from brushgs.pipeline.sequence import paint_sequence
from brushgs.pipeline.sequence_frames import SequenceFrames
from brushgs.rendering import texture_levels
from brushgs.rendering.constants import MAX_ALPHA, MIN_TRANSMITTANCE
from tests.kit.for_each import for_each
from tests.scenes import still_life_of

KERNEL = bg.StrokeTexture.open("gaussian")


@pytest.fixture(scope="module")
def scene():
    """A still life, every seventh Gaussian of which is too faint to be seen."""
    whole = still_life_of(3000)
    opacities = whole.opacities.copy()
    opacities[::7] = 0.003
    return replace(whole, opacities=opacities)


@pytest.fixture(scope="module")
def camera(scene):
    return framed_camera(plain_first_view(scene), ViewConfig(size=(96, 72), zoom=2.5))


def stage(report, name):
    (one,) = [stage for stage in report.stages if stage.name == name]
    return one


def assert_same(one, other):
    """Bit for bit, arrays or values that hold some."""
    for value, expected in zip(columns(one), columns(other), strict=True):
        assert value.any()
        np.testing.assert_array_equal(value, expected)


def columns(value):
    if isinstance(value, tuple):
        return value
    return [column for column in vars(value).values() if isinstance(column, np.ndarray) and column.any()]


def test_passes_skip_what_changes_nothing(scene):
    every = highest(contribution.contributions(scene), len(scene))
    assert_same(bg.prune(scene, 1.0), scene.take(every))
    pruned = bg.prune(scene)
    strokes = bg.cluster(pruned, 400)
    # No Gaussian has company.
    assert_same(bg.cluster(strokes, len(strokes)), merge_clusters(strokes, np.arange(len(strokes))))
    # What is visible is known from clustering.
    labels = group(pruned, 400).labels
    known = merge_clusters(pruned, labels, visible=contribution.visible_shares(pruned))
    assert_same(known, merge_clusters(pruned, labels))


def test_projecting_leaves_out_what_no_pixel_shows(scene, camera):
    filled = np.zeros((len(scene), 16, 3), scene.sh.dtype)
    filled[:, 0] = scene.sh[:, 0]
    flat = replace(scene, sh=filled)
    with patch("brushgs.rendering.project.used_sh_degree", lambda scene: scene.sh_degree):
        all_bands = bg.project(flat, camera)
    assert_same(bg.project(flat, camera), all_bands)
    boxes = bg.project(scene, camera, num_sigmas=KERNEL.num_sigmas)
    drawn = bg.rasterize(boxes, KERNEL, height=72, width=96)
    for more in (with_outside(boxes, scene, camera), with_faint(boxes, scene, camera)):
        assert len(more) > len(boxes), "nothing was skipped, so the test shows nothing"
        assert_same(bg.rasterize(more, KERNEL, height=72, width=96), drawn)


def with_outside(boxes, scene, camera):
    """The boxes, and those that lie in the 24 windows of the picture's size around it."""
    parts, seen = [boxes], np.zeros(len(scene), dtype=bool)
    seen[boxes.ids] = True
    for row, column in np.ndindex(5, 5):
        shift = np.array([(column - 2) * camera.width, (row - 2) * camera.height])
        K = camera.K.copy()
        K[:2, 2] -= shift  # the window moves; the clamp of the Jacobian knows only its size
        found = bg.project(scene, replace(camera, K=K), num_sigmas=KERNEL.num_sigmas)
        fresh = found.take(~seen[found.ids])
        seen[fresh.ids] = True
        parts.append(replace(fresh, centers=(fresh.centers + shift).astype(fresh.centers.dtype)))
    return merged(parts)


def with_faint(boxes, scene, camera):
    """The boxes, and those of opacity under 1/255."""
    least = np.maximum(scene.opacities, np.float32(1.001 / 255))
    found = bg.project(replace(scene, opacities=least), camera, num_sigmas=KERNEL.num_sigmas)
    faint = found.take(scene.opacities[found.ids] < 1 / 255)
    return merged([boxes, replace(faint, opacities=scene.opacities[faint.ids])])


def merged(parts):
    """All boxes by depth, ties by row."""
    names = ("centers", "half_extents", "angles", "depths", "colors", "opacities", "ids")
    together = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    order = np.lexsort((together["ids"], together["depths"]))
    return bg.Boxes(**{name: column[order] for name, column in together.items()})


def test_drawing_makes_the_levels_that_are_used_and_ends_where_pixels_are_finished(scene, camera):
    texture = bg.StrokeTexture.open("swirl")
    boxes = bg.project(bg.cluster(scene, 400), camera, num_sigmas=texture.fitted_sigmas, lock="anchor")
    used = texture_levels.levels_for("drawing", boxes, bg.BrushSet.of(texture), "mip").codes
    every = list(np.ndindex(*(len(levels.axis_levels(size)) for size in reversed(texture.coverage.shape))))
    assert 0 < len(used) < len(every)
    made = []
    for codes in (used, every):
        texture_levels._cache.pop(texture, None)
        packed = texture_levels.packed_levels(texture, codes)
        made.append(tuple(packed[codes.index(code)].pairs[:-1] for code in used))
    assert_same(*made)
    alone = (levels.level_coverage(texture.coverage, *code) for code in used)
    texels = tuple((pairs & 255).astype(np.uint8) for pairs in made[0])  # each with the one below it
    assert_same(texels, tuple(level.ravel() for level in alone))
    # Strokes behind a finished pixel: it ends before the one that would leave less than 1e-4 of its light.
    # The darkest leaves 0.01 of what reaches it, so at most 0.01 is to come, times the brightest color.
    size = {"height": 72, "width": 96, "depth": False}
    with_all = bg.rasterize(boxes, texture, min_transmittance=0.0, **size)
    off = np.abs(bg.rasterize(boxes, texture, **size).rgb - with_all.rgb).max()
    assert 0 < off <= MIN_TRANSMITTANCE / (1 - MAX_ALPHA) * max(1.0, float(boxes.colors.max()))
    with_depth = bg.rasterize(boxes, texture, **size | {"depth": True})
    assert_same(bg.rasterize(boxes, texture, **size), replace(with_depth, depth=None))


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


@pytest.fixture
def resting(tmp_path):
    """A camera that stays, moves, and comes back: views 0 0 0 1 1 0."""
    turn = np.eye(3).tolist()
    view = {"width": 48, "height": 32, "rotation": turn, "fx": 40, "fy": 40}
    here, there = (view | {"position": [x, -2, -12]} for x in (0.3, 0.5))
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
    assert (told.counts["painted"], told.counts["repeated"], told.counts["skipped"]) == (3, 3, 0)
    assert told.skipped == ["3 frames: the camera rests, they equal those before"]
    assert files[0] != files[3]
    monkeypatch.setattr(SequenceFrames, "identity", lambda self, index: (index,))
    every, told = painted("every")
    assert told.counts["painted"] == 6
    assert not told.skipped
    assert files == every
