"""Stiff and hostile scenes through prune and cluster, with every option: what comes back can be painted."""

from dataclasses import replace
from itertools import product
from typing import get_args

import numpy as np
import pytest

from brushgs.options.choices import Features, Merge, Method, Weight
from brushgs.passes.reduce.cluster import cluster
from brushgs.passes.reduce.prune import prune
from brushgs.rendering.render import render
from tests.kit.for_each import for_each
from tests.stiff.scenes import LARGEST, SCENES, resized, scene
from tests.stiff.test_pictures import TEXTURES, assert_finite

# As published; it takes ten times as long as all else here.
HARD_FOR_MINIBATCH = {
    "extents of 2e7", "N = 2", "all positions equal", "all rows equal", "scales of the largest float",
    "some means of the largest float", "1e-30 wide", "1e30 wide",
}  # fmt: skip
METHODS = [method for method in get_args(Method) if method != "auto"]  # which is one of them


@for_each("name", SCENES)
def test_what_passes_make_of_a_scene_can_be_painted(name):
    """`Gaussians` itself refuses NaN, infinity, zero quaternions and opacities out of range."""
    gaussians, camera = SCENES[name].scene.astype(np.float32), SCENES[name].cameras[0]
    wanted = max(1, len(gaussians) // 3)
    results = {f"prune {weight}": prune(gaussians, 0.5, weight=weight) for weight in get_args(Weight)}
    ways = [(*way, "lloyd") for way in product(get_args(Features), get_args(Merge))]
    if name in HARD_FOR_MINIBATCH:
        ways.append(("paper", "paper", "minibatch"))
    for features, merge, method in ways:
        how = {"features": features, "merge": merge, "method": method}
        results[f"cluster {how}"] = cluster(gaussians, wanted, **how)
    for result in results.values():
        assert result.means.dtype == np.float32
        assert min(len(gaussians), 1) <= len(result) <= max(wanted, (len(gaussians) + 1) // 2)
        assert_finite(render(result, camera, TEXTURES["image"], order="soft"))
        assert_finite(render(result, camera, TEXTURES["gaussian"]))


@pytest.mark.parametrize("method", METHODS)
def test_raw_features_of_a_huge_scene_are_still_clustered(method):
    """Squared in float32, coordinates of 1e30 are all infinite: once they made a single cluster."""
    huge, plain = resized(1e30).scene.astype(np.float32), resized(2.0**20).scene.astype(np.float32)
    for gaussians in (huge, plain):
        assert len(cluster(gaussians, 20, features="paper", method=method)) == 20


@pytest.mark.parametrize("merge", get_args(Merge))
def test_merged_scales_end_at_the_largest_number_of_the_type(merge):
    largest = scene(scales=LARGEST, means=lambda m: np.sign(m) * LARGEST).astype(np.float32)
    merged = cluster(largest, 1, merge=merge)
    assert merged.scales.max() == np.float32(LARGEST)


def test_many_equal_gaussians_are_clustered_as_fast_as_others():
    """With equal centers in the tree each query visited all of them: 900,000 rows took a minute."""
    one = scene().take(slice(0, 1)).astype(np.float32)
    equal = one.take(np.zeros(40_000, int))
    apart = equal.means + np.random.default_rng(0).normal(size=(40_000, 3)).astype(np.float32)
    half = replace(equal, means=np.where(np.arange(40_000)[:, None] % 2, equal.means, apart))
    assert len(cluster(equal, 8000)) == 1
    assert 7900 <= len(cluster(half, 8000)) <= 8000
