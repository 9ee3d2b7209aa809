"""Strokes run along what they depict, and nothing else about them changes."""

import numpy as np

import brushgs as bg
from brushgs.passes.form.orient import ASPECT
from tests.kit.for_each import for_each
from tests.passes.form.planks import aspects, long_axes, planks, turned_frame


@for_each("field", ["form", "color"])
def test_strokes_on_planks_run_along_them(field):
    frame = turned_frame()
    strokes, gaussians = planks(frame=frame)
    before = np.abs(long_axes(strokes) @ frame[:, 0])
    after = bg.orient(strokes, gaussians, field)
    along = np.abs(long_axes(after) @ frame[:, 0])
    assert np.median(before) < 0.8
    assert np.quantile(along, 0.05) > np.cos(np.radians(20))
    assert np.median(along) > np.cos(np.radians(8))
    assert np.median(aspects(after)) > 1.8
    assert aspects(after).max() <= ASPECT + 1e-9


def test_own_is_the_input_itself():
    strokes, gaussians = planks(100, 20)
    assert bg.orient(strokes, gaussians, "own") is strokes
