import numpy as np
import pytest

from brushgs.passes.color.pigments import use_pigments
from brushgs.passes.color.tone import grade, tones
from brushgs.values.colors import rgb_of_oklab
from brushgs.values.sh import in_colors
from tests.passes.scenes import random_gaussians, replaced


def greys(lightness, **columns):
    strokes = replaced(random_gaussians(len(lightness)), **columns)
    return in_colors(strokes, rgb_of_oklab(np.outer(lightness, (1.0, 0, 0))))


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


def test_what_changes_nothing_is_the_input_itself_and_no_pigments_are_refused():
    strokes = random_gaussians(3)
    assert grade(strokes) is strokes
    with pytest.raises(ValueError, match="num_pigments"):
        use_pigments(strokes, 0)
