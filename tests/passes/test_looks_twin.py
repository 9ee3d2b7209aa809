"""Colors and brushes of looks: the core against NumPy."""

from dataclasses import replace

import numpy as np

import brushgs as bg
from brushgs.passes.color.pigments import use_pigments
from brushgs.passes.color.tone import grade
from brushgs.passes.form.material import Materials
from tests.kit.for_each import for_each
from tests.passes import looks_twin
from tests.passes.form.test_choose_brushes import SURFACES, surfaces
from tests.passes.scenes import random_gaussians

GRADINGS = (
    (1.35, 1.06, 0.6, (0.012, -0.045), (0.004, 0.03)),
    (0.0, 0.5, 0.714, (0.0, 0.0), (0.1, -0.1)),
    (3.0, 2.0, 0.1, (-0.2, 0.2), (0.0, 0.0)),
)


def strokes_of(seed, dtype=np.float64):
    """Rough and smooth surfaces with strokes of all shapes, sizes and opacities."""
    rng = np.random.default_rng(seed)
    strokes = surfaces() + random_gaussians(300, seed)
    count = len(strokes)
    scales = strokes.scales * np.exp(rng.normal(0, 0.6, (count, 3)))
    scales[:3] = [[0, 0, 0], [0, 0, 1], [0.5, 0, 0.5]]
    sh = strokes.sh + rng.normal(0, 0.3, strokes.sh.shape)
    return replace(strokes, scales=scales, opacities=rng.random(count), sh=sh).astype(dtype)


@for_each("seed", range(3))
@for_each("grading", GRADINGS)
def test_graded_colors_are_those_of_the_twin(seed, grading):
    strokes, names = strokes_of(seed), ("chroma", "contrast", "pivot", "shadows", "lights")
    found = grade(strokes, **dict(zip(names, grading, strict=True))).sh
    expected = looks_twin.grade(strokes, *grading).sh
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)
    assert np.abs(found - strokes.sh).max() > 0.05


@for_each("seed", range(3))
@for_each("num", [1, 2, 22, 5000])
def test_colors_of_pigments_are_those_of_the_twin(seed, num):
    strokes = strokes_of(seed)
    found = use_pigments(strokes, num, share=0.7, seed=seed)
    expected = looks_twin.use_pigments(strokes, num, 0.7, seed)
    np.testing.assert_allclose(found.sh, expected.sh, rtol=1e-9, atol=1e-9)


@for_each("seed", range(4))
@for_each("dtype", [np.float32, np.float64])
@for_each("count", [1, 2, 9, 1500])
def test_surfaces_and_brushes_are_those_of_the_twin(seed, dtype, count):
    strokes = strokes_of(seed, dtype).take(slice(0, count))
    found = Materials.of(strokes)
    expected = looks_twin.surfaces(strokes.astype(np.float64))
    for one, name in zip(expected, ("roughness", "smooth", "rough"), strict=True):
        # Measured: 2e-7 in float32, whose logarithms and distances round apart.
        np.testing.assert_allclose(
            getattr(found, name), one, atol=1e-9 if dtype is np.float64 else 1e-5, err_msg=name
        )
    for material in (0.0, 0.6, 1.0):
        brushes = bg.choose_brushes(strokes, SURFACES, material=material, seed=seed).brushes
        np.testing.assert_array_equal(brushes, looks_twin.choose_brushes(strokes, SURFACES, material, seed))
    if count > 1000:
        assert len(np.unique(brushes)) == len(SURFACES.images)
