"""Painted masks vote on Gaussians; what they hardly show is as its neighbours."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.passes.where.masks import MaskView, mask_votes, settle
from brushgs.rendering.visibility import visible_areas
from tests.kit.regions import REGIONS, cameras, iou, leakage, mask_of, owners
from tests.passes.scenes import rescaled
from tests.scenes import still_life_of

COUNT, SIZE = 8000, (240, 180)


SCENE = still_life_of(COUNT)
OWNER = owners(COUNT)


@pytest.mark.parametrize("name", ["jug", "pear"])
def test_masks_find_the_gaussians_that_they_were_painted_over(name):
    truth = np.isin(OWNER, REGIONS[name])
    seen_by = cameras(5, size=SIZE)
    views = [MaskView(one, mask_of(SCENE, truth, one), np.ones(SIZE[::-1])) for one in seen_by]
    found = mask_votes(SCENE, views) >= 0.5
    between = cameras(3, between=True, size=SIZE)
    seen = sum(visible_areas(SCENE, camera) for camera in between)
    assert iou(found, truth, seen) > 0.95
    assert iou(found, truth) > 0.9
    assert leakage(SCENE, found, truth, between) < 0.01


def test_what_no_view_shows_is_undecided():
    blind = replace(cameras(1, size=SIZE)[0], near=1e6)
    votes = mask_votes(SCENE, [MaskView(blind, np.ones(SIZE[::-1]), np.ones(SIZE[::-1]))])
    np.testing.assert_allclose(votes, 0.5)


def test_hidden_gaussians_agree_with_their_surface():
    jug = np.isin(OWNER, REGIONS["jug"])
    trust = (np.random.default_rng(0).random(len(SCENE)) < 0.2).astype(float)
    votes = np.where(trust > 0, jug, 0.5)
    settled = settle(SCENE, votes, trust)
    assert ((settled >= 0.5) == jug).mean() > 0.99
    np.testing.assert_allclose(settle(rescaled(SCENE, 1e3), votes, trust), settled, atol=1e-3)
