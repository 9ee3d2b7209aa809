"""What surface strokes are of: how rough, and which are smooth and light."""

from dataclasses import replace

import numpy as np

from brushgs.passes.form.material import Materials
from brushgs.values.colors import rgb_of_oklab
from brushgs.values.sh import in_colors
from tests.kit.for_each import for_each
from tests.passes.scenes import random_gaussians


def wall(num=400, *, normals=0.0, colors=0.0, sizes=0.0, lightness=0.6, at=0.0, seed=0):
    """A square of strokes that face z; how much their normals, colors and sizes differ by chance."""
    g = np.random.default_rng(seed)
    means = np.stack([at + g.uniform(-1, 1, num), g.uniform(-1, 1, num), np.zeros(num)], axis=1)
    quats = np.concatenate([np.ones((num, 1)), normals * g.normal(size=(num, 3))], axis=1)
    scales = np.array([0.1, 0.06, 0.004]) * np.exp(sizes * g.normal(size=(num, 1)))
    lab = np.array([lightness, 0, 0]) + colors * g.normal(size=(num, 3)) * (1, 0.5, 0.5)
    strokes = replace(random_gaussians(num), means=means, quats=quats, scales=scales)
    strokes = replace(strokes, opacities=np.full(num, 0.9))
    return in_colors(strokes, np.clip(rgb_of_oklab(lab), 0, 1))


FUR = {"normals": 1.0, "colors": 0.1, "sizes": 0.5}


@for_each(
    ("what", "weight", "spreads"),
    [
        ("normals", 0.5, (0.05, 0.15, 0.5)),
        ("colors", 0.3, (0.02, 0.05, 0.1)),
        ("sizes", 0.2, (0.1, 0.2, 0.5)),
    ],
)
def test_each_spread_counts_and_the_more_the_rougher(what, weight, spreads):
    found = [Materials.of(wall(**{what: spread})).roughness.mean() for spread in spreads]
    assert Materials.of(wall()).roughness.max() < 0.01
    assert found[0] < found[1] < found[2] <= weight + 1e-9
    assert found[2] > 0.7 * weight
    assert Materials.of(wall(**FUR)).roughness.min() > 0.8


def test_roughness_is_that_of_a_surface_not_of_a_stroke():
    strokes = wall()
    quats = strokes.quats.copy()
    quats[100] = (1, 1, 0, 0)  # one that stands upright
    found = Materials.of(replace(strokes, quats=quats)).roughness
    assert found.max() < 0.15
    both = Materials.of(replace(wall(800, **FUR), means=wall(800).means)).roughness
    neighbours = np.argsort(np.linalg.norm(wall(800).means - wall(800).means[0], axis=1))[:20]
    assert np.ptp(both[neighbours]) < 0.15


def test_of_a_wall_beside_fur_the_wall_is_smooth_where_it_is_light_and_the_fur_rough():
    lit, dark, fur = wall(lightness=0.75), wall(lightness=0.3, at=5), wall(**FUR, lightness=0.5, at=10)
    found = Materials.of(lit + dark + fur)
    of_lit, of_dark, of_fur = slice(0, 400), slice(400, 800), slice(800, 1200)
    assert found.smooth[of_lit].min() > 0.95
    assert found.smooth[of_dark].max() < 0.05
    assert found.rough[of_fur].min() > 0.95
    assert found.rough[:800].max() == found.smooth[of_fur].max() == 0
    assert not (found.smooth * found.rough).any()
