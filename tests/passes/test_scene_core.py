"""Scenes before they are clustered, and clusters that are merged: the core against its NumPy twins."""

import numpy as np

from brushgs.core.native import core as _core
from brushgs.passes.extent import robust_frame
from brushgs.passes.finest import finest_of, seen_scales
from brushgs.passes.groups import Groups
from brushgs.passes.reduce.contribution import projected_areas, seen_areas, visible_shares
from brushgs.passes.reduce.detail import color_detail
from brushgs.passes.reduce.features import cluster_features, contracted, spans_of
from brushgs.passes.reduce.merge import OVERLAP, merge_clusters, principal_axes
from brushgs.passes.reduce.morton import morton_order
from brushgs.passes.reduce.prune import highest, num_spare, spread
from brushgs.values.gaussians import GAUSSIAN_COLUMNS, Gaussians
from tests.kit.for_each import for_each
from tests.passes import moments_twin, scene_twin
from tests.passes.scenes import columns_of, covariances, random_gaussians, replaced, strange_strokes
from tests.passes.test_moments import SCALARS, with_threads

STRANGE = strange_strokes()
FRAME = np.array([0.1, -0.2, 0.3]), 1.7


@for_each("name", STRANGE)
@for_each("dtype", SCALARS)
def test_the_extent_is_that_of_percentiles(name, dtype):
    means = STRANGE[name].astype(dtype).means
    if not len(means):
        return
    center, radius = robust_frame(means)
    expected, size = scene_twin.robust_extent(means)
    np.testing.assert_array_equal(center, expected)
    np.testing.assert_allclose(radius, size, rtol=4e-16)


def test_the_extent_of_few_points_is_that_of_all_and_never_zero():
    for points, expected in (
        (np.zeros((0, 3)), (np.zeros(3), 1.0)),
        (np.ones((1, 3)), (np.ones(3), 1.0)),
        (np.array([[2.0, 0, 0], [-2.0, 0, 0]]), (np.zeros(3), 0.98 * 2)),
        (np.array([[0.0, 0, 0]] * 300 + [[4.0, 0, 0]]), (np.array([2.0, 0, 0]), 2.0)),
    ):
        center, radius = robust_frame(points)
        np.testing.assert_allclose(center, expected[0], atol=1e-15)
        np.testing.assert_allclose(radius, expected[1])


@for_each("name", STRANGE)
@for_each("dtype", SCALARS)
def test_features_are_those_of_the_twin(name, dtype):
    scene = STRANGE[name].astype(dtype)
    expected = scene_twin.contracted(scene.means, *FRAME)
    for one, other in zip(with_threads(lambda: contracted(scene.means, FRAME)), expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-15, atol=1e-300)
    points = with_threads(lambda: [cluster_features(scene, frame=FRAME)])[0]
    np.testing.assert_allclose(points, scene_twin.features(scene, *FRAME), rtol=1e-7, atol=1e-45)
    spans = with_threads(lambda: [spans_of(scene, points)])[0]
    np.testing.assert_allclose(spans, scene_twin.spans(scene, points), rtol=1e-6, atol=1e-9)


@for_each("name", STRANGE)
@for_each("dtype", SCALARS)
@for_each("finest", [0.0, 0.01, 3.0])
def test_visible_scales_are_those_of_the_twin(name, dtype, finest):
    scales = STRANGE[name].astype(dtype).scales
    expected = scene_twin.seen_scales(scales, finest)
    np.testing.assert_array_equal(seen_scales(scales, finest), expected)
    np.testing.assert_array_equal(projected_areas(scales, finest), projected_areas(expected))


@for_each("dtype", SCALARS)
@for_each("unit", [1.0, 1e-15])
def test_visible_shares_are_those_of_the_twin(dtype, unit):
    scene = random_gaussians(250, size=0.4)
    stacks = np.round(2 * scene.means) / 2 + 0.001 * np.sin(scene.means)  # several in a column
    scene = replaced(scene, means=stacks * unit, scales=scene.scales * unit).astype(dtype)
    found = with_threads(lambda: [visible_shares(scene)])[0]
    expected = scene_twin.visible_shares(scene.means, scene.opacities, seen_areas(scene))
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    assert found.std() > 0.1, "all are as visible"


@for_each("num", [1, 15, 16, 40, 48, 500])
@for_each("dtype", SCALARS)
def test_color_detail_is_that_of_the_twin(num, dtype):
    scene = random_gaussians(num).astype(dtype)
    order = morton_order(contracted(scene.means)[0])
    found = with_threads(lambda: [color_detail(scene)])[0]
    np.testing.assert_allclose(found, scene_twin.color_detail(scene.sh, order), rtol=1e-12, atol=1e-12)


def test_weights_are_those_of_the_twin_and_above_zero():
    rng = np.random.default_rng(0)
    contributions, detail = rng.random(300) ** 9, 0.3 * rng.random(300)
    contributions[:3] = 0, 1e-300, 1e30
    for values in (contributions, np.zeros(300)):
        found = _core.cluster_weights(values, detail)
        np.testing.assert_allclose(found, scene_twin.cluster_weights(values, detail), rtol=1e-12)
        assert found.min() > 0


@for_each("num", [1, 2, 300])
def test_ranks_and_what_can_be_spared_are_those_of_the_twin(num):
    scene, weights = random_gaussians(num), np.random.default_rng(2).random(num) ** 4
    order = morton_order(contracted(scene.means)[0])
    ranked = with_threads(lambda: [spread(weights, scene)])[0]
    np.testing.assert_allclose(ranked, scene_twin.spread(weights, order), rtol=1e-12)
    for some in (weights, np.ones(num), np.zeros(num)):
        assert num_spare(some, ranked) == scene_twin.num_spare(some, ranked)


@for_each("count", [1, 7, 50, 99, 100])
def test_the_highest_weights_are_kept_and_of_equal_ones_the_first(count):
    weights = np.random.default_rng(2).integers(0, 9, 100).astype(float)
    expected = np.zeros(100, bool)
    expected[np.argsort(-weights, kind="stable")[:count]] = True
    np.testing.assert_array_equal(highest(weights, count), expected)


def cover_of(scene, labels, visible, areas, finest):
    """Means, covariances, opacities and colors by "cover", from kernels that have twins of their own."""
    num = labels.max() + 1
    groups = Groups.of(labels, num)
    shares = moments_twin.shares_by_label(scene.opacities * areas, labels, num)
    means = groups.sums(scene.means, shares)
    own = covariances(scene.astype(np.float64))
    within, between = moments_twin.within_and_between(scene, own, means, shares, labels)
    footprints = moments_twin.areas(scene_twin.seen_scales(principal_axes(within + between)[0], finest))
    opacities = moments_twin.stopped(scene.opacities, areas, footprints, labels)
    scales, axes = principal_axes(within + OVERLAP * between)
    more = _core.growth(means, scene_twin.seen_scales(scales, finest), axes, opacities, 1)
    covars = within + (OVERLAP + more)[:, None, None] * between
    sh = groups.sums(scene.sh, moments_twin.shares_by_label(shares * visible, labels, num))
    return means, covars, opacities, sh


@for_each("name", ["needles", "discs", "a plane", "opaque", "transparent", "an outlier", "balls"])
@for_each("dtype", SCALARS)
def test_merged_gaussians_are_those_of_the_twin(name, dtype):
    scene, rng = STRANGE[name].astype(dtype), np.random.default_rng(5)
    labels = np.concatenate([np.arange(12), rng.integers(0, 6, len(scene) - 12)]).astype(np.int32)
    visible, areas = rng.random(len(scene)) + 0.01, seen_areas(scene)
    merged = Gaussians(
        *with_threads(lambda: columns_of(merge_clusters(scene, labels, visible=visible, areas=areas)))
    )
    expected = cover_of(scene, labels, visible, areas, finest_of(scene))
    found = merged.means, covariances(merged.astype(np.float64)), merged.opacities, merged.sh
    for one, other in zip((column[:6] for column in found), (column[:6] for column in expected), strict=True):
        size = np.abs(other).reshape(len(other), -1).max(axis=1).reshape(-1, *[1] * (other.ndim - 1))
        assert (np.abs(one - other) <= (1e-5 if dtype is np.float32 else 1e-9) * size).all()
    for column in GAUSSIAN_COLUMNS:  # alone
        np.testing.assert_array_equal(getattr(merged, column)[6:], getattr(scene, column)[6:12])
