"""Clusters are cut where their members lie side by side, not along what each of them spans itself."""

import numpy as np
import pytest

from brushgs.passes.reduce.features import cluster_features, spans_of
from brushgs.passes.reduce.split import cut
from tests.passes.scenes import random_gaussians, replaced


def lines(length, *, turned=(1, 0, 0, 0)):
    """40 Gaussians in two rows, 2 wide and 1 apart, whose own axis along the rows is so long."""
    g = np.random.default_rng(0)
    along, row = g.uniform(-1, 1, 40), np.repeat((-0.5, 0.5), 20)
    means = np.stack([along, row, np.zeros(40)], axis=1)
    scales = np.tile((length, 0.05, 0.05), (40, 1))
    quats = np.tile(np.array(turned, float), (40, 1))
    return replaced(random_gaussians(40), means=means, scales=scales, quats=quats, sh=np.zeros((40, 1, 3)))


def halves(scene):
    points = cluster_features(scene)
    return cut(np.zeros(40, np.intp), np.array([0]), points, np.ones(40), spans_of(scene, points))


@pytest.mark.parametrize("unit", [2.0**-60, 1.0, 2.0**60])
def test_a_cut_parts_what_lies_side_by_side(unit):
    def scaled(scene):
        return replaced(scene, means=scene.means * unit, scales=scene.scales * unit)

    short, long, across = (
        halves(scaled(scene)) for scene in (lines(0.05), lines(1.0), lines(1.0, turned=(1, 0, 0, 1)))
    )
    is_upper = np.repeat((False, True), 20)
    assert 10 <= np.count_nonzero(short == short[0]) <= 30  # the rows are cut across: that way is longest
    assert 0 < np.count_nonzero((short == short[0]) & is_upper) < 20
    np.testing.assert_array_equal(long == long[0], ~is_upper)
    assert 0 < np.count_nonzero((across == across[0]) & is_upper) < 20


def test_members_at_one_place_are_cut_by_color_and_stay_finite():
    scene = lines(1.0)
    sh = np.repeat((-0.5, 0.5), 20)[:, None, None] * np.ones((40, 1, 3))
    labels = halves(replaced(scene, means=np.zeros((40, 3)), sh=sh))
    np.testing.assert_array_equal(labels == labels[0], np.repeat((True, False), 20))


@pytest.mark.parametrize("sign", [1, -1])
def test_halves_do_not_hang_on_the_sign_of_an_eigenvector(sign, monkeypatch):
    eigh = np.linalg.eigh
    monkeypatch.setattr(np.linalg, "eigh", lambda a: (eigh(a)[0], sign * eigh(a)[1]))
    assert halves(lines(1.0))[0] == 0
