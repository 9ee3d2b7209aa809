import numpy as np
import pytest

from brushgs.passes.color.pigments import use_pigments
from brushgs.passes.color.tone import grade, tones
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.sh import base_colors, in_colors
from tests.passes.scenes import assert_same, random_gaussians, replaced


def with_lab(strokes, lab):
    return in_colors(strokes, rgb_of_oklab(np.asarray(lab, float)))


def greys(lightness, **columns):
    lightness = np.asarray(lightness, float)
    strokes = replaced(random_gaussians(len(lightness)), **columns)
    return with_lab(strokes, np.stack([lightness, 0 * lightness, 0 * lightness], axis=1))


def lab_of(strokes):
    return oklab_of(base_colors(strokes.sh))


def test_grade_scales_chroma_and_contrast_and_shifts_shadows_and_lights():
    g = np.random.default_rng(0)
    lab = np.stack(
        [g.uniform(0.3, 0.8, 500), g.uniform(-0.03, 0.03, 500), g.uniform(-0.03, 0.03, 500)], axis=1
    )
    strokes = with_lab(random_gaussians(500), lab)
    chroma = lab_of(grade(strokes, chroma=1.5))
    np.testing.assert_allclose(chroma, lab * (1, 1.5, 1.5), atol=1e-6)
    contrast = lab_of(grade(strokes, contrast=0.5, pivot=0.7))
    np.testing.assert_allclose(contrast[:, 0], 0.7 + 0.5 * (lab[:, 0] - 0.7), atol=1e-6)
    shifted = lab_of(grade(strokes, shadows=(0.0, -0.04), lights=(0.0, 0.03)))[:, 2] - lab[:, 2]
    assert (shifted[lab[:, 0] < 0.6] < 0).all()
    assert (shifted[lab[:, 0] > 0.64] > 0).all()
    assert np.corrcoef(shifted, lab[:, 0])[0, 1] > 0.9
    assert grade(strokes) is strokes


def test_equalized_tones_are_the_share_of_painted_area_that_is_darker():
    lightness = np.random.default_rng(1).uniform(0.2, 0.9, 400) ** 3
    same = {"scales": np.ones((400, 3)), "opacities": np.full(400, 0.5)}
    tone = tones(greys(lightness, **same), local=0, equalized=1)
    rank = np.argsort(np.argsort(lightness))
    np.testing.assert_allclose(tone, (rank + 1) / 400, atol=1e-9)


def test_local_tones_tell_a_dark_spot_from_what_surrounds_it_on_either_side_of_the_scene():
    g = np.random.default_rng(2)
    means = g.uniform(0, 1, (2000, 3)) * (2, 1, 0.01)
    is_right = means[:, 0] > 1
    spots = np.linalg.norm(means[:, None, :2] - [[0.5, 0.5], [1.5, 0.5]], axis=2).min(axis=1) < 0.06
    strokes = greys(np.where(is_right, 0.8, 0.4) - 0.15 * spots, means=means)
    local = tones(strokes, local=1.0)
    away = np.abs(means[:, 0] - 1) > 0.3  # from the edge between the halves
    for side in (is_right, ~is_right):
        assert local[side & spots].max() < 0.4
        assert local[side & ~spots & away].mean() > 0.48
    whole = tones(strokes, local=0)
    assert whole[is_right & spots].min() > whole[~is_right].max()


def test_pigments_are_as_many_as_asked_for_and_the_means_of_what_they_stand_for():
    g = np.random.default_rng(5)
    centres = np.array([[0.3, 0.05, 0.02], [0.6, -0.05, 0.03], [0.8, 0.0, -0.04]])
    which = g.integers(0, 3, 600)
    lab = centres[which] + g.normal(0, 0.004, (600, 3))
    same = {"scales": np.ones((600, 3)), "opacities": np.full(600, 0.5)}
    strokes = with_lab(replaced(random_gaussians(600), **same), lab)
    pure = lab_of(use_pigments(strokes, 3, share=1.0))
    found = np.unique(pure.round(6), axis=0)
    assert len(found) == 3
    for kind in range(3):
        assert pure[which == kind] == pytest.approx(
            np.tile(lab[which == kind].mean(axis=0), (sum(which == kind), 1)), abs=1e-4
        )
    half = lab_of(use_pigments(strokes, 3, share=0.5))
    np.testing.assert_allclose(half, (lab + pure) / 2, atol=1e-4)
    assert_same(use_pigments(strokes, 5, seed=1), use_pigments(strokes, 5, seed=1))
    for few in (0, 2):
        assert len(use_pigments(strokes.take(slice(few)), 8)) == few
    with pytest.raises(ValueError, match="num_pigments"):
        use_pigments(strokes, 0)
