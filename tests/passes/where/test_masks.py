"""Painted masks vote on Gaussians; what they hardly show is as its neighbours."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.passes.where.masks import MaskView, mask_votes, settle
from brushgs.rendering.visibility import visible_areas
from tests.kit.regions import REGIONS, cameras, iou, leakage, mask_of, owners
from tests.scenes import still_life_of

COUNT, SIZE = 8000, (240, 180)


@pytest.fixture(scope="module")
def scene():
    return still_life_of(COUNT)


@pytest.fixture(scope="module")
def owner():
    return owners(COUNT)


def views_of(scene, inside, num=3):
    return [
        MaskView(camera, mask_of(scene, inside, camera), np.ones((camera.height, camera.width)))
        for camera in cameras(num, size=SIZE)
    ]


@pytest.mark.parametrize("name", ["jug", "pear"])
def test_masks_find_the_gaussians_that_they_were_painted_over(scene, owner, name):
    truth = np.isin(owner, list(REGIONS[name]))
    found = mask_votes(scene, views_of(scene, truth, 5)) >= 0.5
    between = cameras(3, between=True, size=SIZE)
    seen = sum(visible_areas(scene, camera) for camera in between)
    assert iou(found, truth, seen) > 0.95
    assert iou(found, truth) > 0.9
    assert leakage(scene, found, truth, between) < 0.01


def test_what_no_view_shows_is_undecided(scene):
    blind = replace(cameras(1, size=SIZE)[0], near=1e6)
    votes = mask_votes(scene, [MaskView(blind, np.ones(SIZE[::-1]), np.ones(SIZE[::-1]))])
    np.testing.assert_allclose(votes, 0.5)


def test_hidden_gaussians_agree_with_their_surface(scene, owner):
    jug = np.isin(owner, list(REGIONS["jug"]))
    trust = (np.random.default_rng(0).random(len(scene)) < 0.2).astype(float)
    settled = settle(scene, np.where(trust > 0, jug, 0.5), trust)
    assert ((settled >= 0.5) == jug).mean() > 0.99
    unit = 1e3
    larger = replace(scene, means=scene.means * np.float32(unit), scales=scene.scales * np.float32(unit))
    np.testing.assert_allclose(settle(larger, np.where(trust > 0, jug, 0.5), trust), settled, atol=1e-3)
