"""Detail that is lost with distance, in whole paintings: stills, films, and what is exported."""

import numpy as np

from brushgs.options.focus import Focus
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from tests.kit import blind, stages, still_life_of

SCENE = still_life_of(1500)
NEAR = (*SCENE.means[SCENE.means[:, 2].argmin()].tolist(), 0.3)


def painted(strength, count=300, **strokes):
    report = Report()
    config = blind("oil", count, (96, 72), strokes={"depth_of_field": strength} | strokes, view={"up": "-y"})
    return prepare(SCENE, config, report), report


def test_switched_off_nothing_is_made_for_it():
    assert not {"lens", "depth of field"} & set(stages(painted(0.0)[1]))


def blur_of(found, report):
    """Blur of the strokes by the depths in focus that the report states, for one view."""
    ((low, high),) = stages(report)["lens"].counts["depths"]
    viewmat = found.cameras[0].viewmat
    depths = found.strokes.means @ viewmat[2, :3] + viewmat[2, 3]
    return np.minimum(np.abs(np.clip(depths, low, high) / depths - 1), 1)


def test_what_is_out_of_focus_gets_fewer_strokes():
    focus = Focus(sphere=NEAR)
    soft, report = painted(1.0, focus=focus)
    sharp, _ = painted(0.0, focus=focus)
    limit = np.quantile(blur_of(sharp, report), 0.25)
    assert (blur_of(soft, report) < limit).mean() > 0.3


def test_the_same_strokes_grow_by_the_law_unless_they_would_be_too_long():
    focus = Focus(sphere=NEAR)
    found = [painted(strength, focus=focus, economy=0.0, count=None) for strength in (1.0, 0.0)]
    (soft, report), (sharp, _) = found
    np.testing.assert_array_equal(soft.strokes.means, sharp.strokes.means)
    growth = soft.strokes.scales[:, 0] / sharp.strokes.scales[:, 0]
    expected = 1 + 2 * blur_of(sharp, report)
    assert (growth >= 1 - 1e-6).all()
    assert (growth <= expected * (1 + 1e-3)).all()  # the depths in the report are rounded
    assert np.isclose(growth, expected, rtol=1e-3).mean() > 0.2  # the rest are large in this picture
    assert expected.max() > 1.5
    grown = growth > 1.001
    assert (soft.strokes.opacities[grown] < sharp.strokes.opacities[grown]).all()
