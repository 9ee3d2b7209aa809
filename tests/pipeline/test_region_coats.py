"""Marks of every medium bear the part of the scene that they lie in."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.options.look import Look
from brushgs.options.rules import Rule, Rules
from brushgs.options.where import Where
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.still_life import still_life_camera
from tests.scenes import still_life_of


@pytest.fixture(scope="module")
def scene():
    return still_life_of(3000)


@pytest.mark.parametrize("look", ["oil", "watercolour", "ink"])
def test_every_coat_but_the_backdrop_bears_parts(scene, look):
    config = Look.open(look).config
    config = replace(
        config,
        cluster=replace(config.cluster, strokes=200),
        strokes=replace(config.strokes, see="off", economy=0.0),  # pieces keep the part of their Gaussian
        rules=Rules((Rule(Where.parse("half:-1,0,0,0")),)),
    )
    prepared = prepare(scene, config, Report(), views=still_life_camera(width=160, height=120))
    strokes, coats = prepared.strokes, prepared.painting.coats
    assert "lines" in {coat.name for coat in coats} or look == "oil"
    assert set(coats[0].strokes.regions) == {0, 1}
    for coat in coats:
        means, regions = coat.strokes.means, coat.strokes.regions
        assert set(regions) <= {0, 1}
        if coat.chains is not None or coat.name == "lines":  # no strokes: they have the part of the nearest
            away = np.linalg.norm(means[:, None].astype(float) - strokes.means, axis=2)
            np.testing.assert_array_equal(regions, strokes.regions[away.argmin(axis=1)])
        else:
            np.testing.assert_array_equal(regions == 1, means[:, 0] < 0)
