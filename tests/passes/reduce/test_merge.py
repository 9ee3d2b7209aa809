import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brushgs.passes.reduce.contribution import seen_areas
from brushgs.passes.reduce.merge import merge_clusters, principal_axes
from tests.kit.for_each import for_each
from tests.passes.scenes import assert_same, covariances, random_gaussians, replaced
from tests.passes.test_moments import with_threads


def random_labels(n, k, seed=0):
    return np.random.default_rng(seed).integers(0, k, n)


@given(st.integers(0, 10_000), st.sampled_from([0.5, 1.0, 1.4]))
def test_cover_has_the_weighted_mean_and_the_total_variance_with_what_lies_between_raised(seed, overlap):
    scene, labels = random_gaussians(60, seed), random_labels(60, 5, seed)
    merged = merge_clusters(scene, labels, overlap=overlap)
    weights, own = scene.opacities * seen_areas(scene), covariances(scene)
    is_merged = np.bincount(labels, minlength=5)[np.unique(labels)] > 1
    assert (np.diff(merged.scales[is_merged], axis=1) >= 0).all()
    np.testing.assert_allclose(np.linalg.norm(merged.quats[is_merged], axis=1), 1, rtol=1e-12)
    for row, label in enumerate(np.unique(labels)):
        of = labels == label
        mean = np.average(scene.means[of], axis=0, weights=weights[of])
        np.testing.assert_allclose(merged.means[row], mean, rtol=1e-9, atol=1e-12)
        if is_merged[row]:
            within = np.average(own[of], axis=0, weights=weights[of])
            between = np.cov(scene.means[of].T, aweights=weights[of], ddof=0)
            total = within + overlap * between
            np.testing.assert_allclose(covariances(merged)[row], total, rtol=1e-9, atol=1e-9)


def test_published_rule_is_plain_means_with_the_real_cube_root():
    scene, labels = random_gaussians(30, terms=9), random_labels(30, 3)
    merged = merge_clusters(scene, labels, merge="paper")
    for row in range(3):
        of = labels == row
        np.testing.assert_allclose(merged.means[row], scene.means[of].mean(axis=0), rtol=1e-9)
        np.testing.assert_allclose(merged.opacities[row], scene.opacities[of].mean(), rtol=1e-9)
        np.testing.assert_allclose(merged.sh[row], scene.sh[of].mean(axis=0), rtol=1e-9, atol=1e-12)
        expected = scene.scales[of].mean(axis=0) * of.sum() ** (1 / 3)
        np.testing.assert_allclose(merged.scales[row], expected, rtol=1e-9)


@pytest.mark.parametrize("merge", ["cover", "paper"])
def test_names_of_labels_do_not_matter_but_their_order_is_that_of_the_rows(merge):
    scene, labels = random_gaussians(50), random_labels(50, 7)
    merged = merge_clusters(scene, labels, merge=merge)
    assert_same(merge_clusters(scene, labels * 1000 - 3, merge=merge), merged)
    reverse = merge_clusters(scene, -labels, merge=merge)
    np.testing.assert_array_equal(reverse.means, merged.means[::-1])


def test_color_is_that_of_what_is_seen():
    scene = random_gaussians(20_000)
    inside = np.linalg.norm(scene.means, axis=1) < 1.5
    sh = np.where(inside[:, None, None], -1.0, 1.0) * np.ones((20_000, 1, 3))
    scene = replaced(scene, sh=sh, scales=np.full((20_000, 3), 0.1), opacities=np.full(20_000, 0.9))
    assert merge_clusters(scene, np.zeros(20_000, dtype=int)).sh.min() > 0.5


def test_principal_axes_rebuild_the_covariance_and_are_right_handed_with_signs_of_their_own():
    axes = np.random.default_rng(0).normal(size=(100, 3, 3)) * 10.0 ** np.arange(-50, 50)[:, None, None]
    covars = axes @ axes.transpose(0, 2, 1)
    scales, turned = with_threads(lambda: principal_axes(covars))
    back = turned @ (scales[:, :, None] ** 2 * turned.transpose(0, 2, 1))
    size = np.abs(covars).max(axis=(1, 2), keepdims=True)
    np.testing.assert_allclose(back / size, covars / size, atol=1e-13)
    np.testing.assert_allclose(np.linalg.det(turned), 1)
    largest = np.take_along_axis(turned, np.abs(turned).argmax(axis=1)[:, None], axis=1)[:, 0]
    assert (largest[:, 1:] > 0).all()
    scales, turned = principal_axes(np.zeros((1, 3, 3)))
    assert not scales.any()
    np.testing.assert_allclose(np.linalg.det(turned), 1)


@for_each(
    ("labels", "options", "error", "message"),
    [
        (np.zeros(3, int), {}, ValueError, r"labels must have shape \[N=4\], got \[3\]"),
        (np.zeros(4), {}, TypeError, "labels must be integers, got float64"),
        (np.zeros(4, int), {"merge": "mean"}, ValueError, "merge must be 'cover' or 'paper', got 'mean'"),
        (np.zeros(4, int), {"overlap": 0}, ValueError, "overlap must be > 0 and finite, got 0"),
    ],
)
def test_bad_arguments_are_refused_by_name(labels, options, error, message):
    with pytest.raises(error, match=f"merge_clusters: {message}"):
        merge_clusters(random_gaussians(4), labels, **options)
