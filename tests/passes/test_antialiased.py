"""Whether a scene is antialiased stays with what is made of it."""

from dataclasses import replace

import numpy as np

import brushgs as bg
from tests.kit.for_each import for_each
from tests.passes.scenes import random_gaussians

PALETTE = np.random.default_rng(0).random((8, 8, 3))
PASSES = {
    "prune": lambda scene: bg.prune(scene, keep=0.5),
    "cluster": lambda scene: bg.cluster(scene, 9),
    "cluster as published": lambda scene: bg.cluster(scene, 9, merge="paper"),
    "recolor": lambda scene: bg.recolor(scene, bg.Palette.of_image(PALETTE)),
    "take": lambda scene: scene.take(slice(0, 5)),
}


@for_each("name", PASSES)
@for_each("antialiased", [False, True])
def test_every_pass_keeps_it(name, antialiased):
    scene = replace(random_gaussians(60), antialiased=antialiased)
    assert PASSES[name](scene).antialiased is antialiased
