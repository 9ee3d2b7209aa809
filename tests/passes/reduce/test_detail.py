import numpy as np
import pytest

from brushgs.passes.reduce.cluster import cluster_weights
from brushgs.passes.reduce.detail import color_detail
from brushgs.values.sh import C0
from tests.passes.scenes import random_gaussians, replaced


def halves():
    """A grey half at negative x, and one of black and white Gaussians."""
    scene = random_gaussians(2048)
    means = np.random.default_rng(0).uniform(-1, 1, (2048, 3))
    colors = np.where(means[:, :1] < 0, 0.5, np.arange(2048)[:, None] % 2) * np.ones(3)
    same = {"scales": np.full((2048, 3), 0.01), "opacities": np.full(2048, 0.5)}
    return replaced(scene, means=means, sh=((colors - 0.5) / C0)[:, None], **same)


def test_detail_is_the_deviation_of_colors_among_neighbours():
    scene = halves()
    detail, x = color_detail(scene), scene.means[:, 0]
    assert np.quantile(detail[x < -0.1], 0.9) < 1e-6  # the curve leaps, with a few groups
    assert detail[x > 0.1].mean() == pytest.approx(0.5 * np.sqrt(3), rel=0.1)


def test_detail_attracts_strokes():
    scene = halves()
    weights, x = cluster_weights(scene), scene.means[:, 0]
    assert np.median(weights[x > 0.1]) > 8 * np.median(weights[x < -0.1])
