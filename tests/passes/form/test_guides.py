"""Strokes follow the guides near them, whatever the surface says, and the surface elsewhere."""

import json

import numpy as np

import brushgs as bg
from brushgs.formats.guides import Guides
from brushgs.options.direction import Direction
from tests.passes.form.planks import long_axes, planks
from tests.passes.scenes import assert_same, covariances, rescaled


def line(*points, reach=None):
    points = np.array(points, dtype=float)
    return Guides(points[:-1], points[1:], reach)


def test_strokes_follow_a_guide_within_its_reach_and_the_planks_beyond():
    strokes, gaussians = planks(num_strokes=600)
    after = bg.orient(strokes, gaussians, line([0, -1, 0], [0, 1, 0], reach=0.4))
    axes, away = np.abs(long_axes(after)), np.abs(strokes.means[:, 0])
    assert np.quantile(axes[away < 0.12, 1], 0.1) > np.cos(np.radians(15))
    assert np.quantile(axes[away > 0.7, 0], 0.1) > np.cos(np.radians(20))
    form = bg.orient(strokes, gaussians)
    far = away > 0.9 - 0.1  # smoothing carries a guide on, ever less
    np.testing.assert_allclose(covariances(after)[far], covariances(form)[far], atol=0.1 * 0.1**2)


def test_strokes_point_where_the_guide_was_drawn_to():
    strokes, gaussians = planks()
    for end in (1.0, -1.0):
        after = bg.orient(strokes, gaussians, line([-end, 0, 0], [end, 0, 0], reach=2.0))
        assert (np.sign(long_axes(after)[:, 0]) == end).all()


def test_the_default_reach_is_a_share_of_the_scene():
    strokes, gaussians = planks()
    guide = line([0, -1, 0], [0, 1, 0])
    expected = covariances(bg.orient(strokes, gaussians, guide))
    larger = Guides(guide.starts * 64, guide.ends * 64)
    found = bg.orient(rescaled(strokes, 64), rescaled(gaussians, 64), larger)
    np.testing.assert_allclose(covariances(found) / 64**2, expected, rtol=1e-7, atol=1e-12)
    assert not np.allclose(covariances(bg.orient(strokes, gaussians)), expected)


def test_a_direction_names_the_file(tmp_path):
    path = tmp_path / "guides.json"
    path.write_text(json.dumps({"reach": 0.4, "guides": [[[0, -1, 0], [0, 1, 0]]]}))
    strokes, gaussians = planks()
    expected = bg.orient(strokes, gaussians, line([0, -1, 0], [0, 1, 0], reach=0.4))
    for field in (f"guides:{path}", Direction("guides", path)):
        assert_same(bg.orient(strokes, gaussians, field), expected)
