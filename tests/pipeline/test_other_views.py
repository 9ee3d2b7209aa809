"""A prepared painting, seen by other cameras, is what `prepare` makes for them of the same strokes."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.cameras.paths import turn_around
from brushgs.options.sequence import PathConfig
from brushgs.pipeline.other_views import along, seen_by
from brushgs.pipeline.prepare import PICTURE, prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.still import paint_view
from tests.kit import blind, still_life_of

SCENE = still_life_of(1000)


def config_of(look):
    """Of strokes that no view of the job guides: they are the same whatever is seen."""
    off = {"focus": None, "economy": 0.0, "edges": 0.0}
    unlit = {"color": {"values": 0.0}, "light": {"key": 0.0}, "ground": {"backdrop": 0, "stage": False}}
    return blind(look, 100, (96, 72), strokes=off, **unlit)


@pytest.mark.parametrize("look", ["oil", "gouache"])
def test_another_camera_sees_what_is_prepared_for_it(look):
    config = config_of(look)
    prepared = prepare(SCENE, config, Report(), asks=(*PICTURE, "scene"))
    camera = turn_around(prepared.camera, (0, 0, 0), (0, -1, 0), seconds=1, fps=7).cameras[2].resized(64, 40)
    seen = paint_view(seen_by(prepared, config, camera, Report()), Report())
    sized = replace(config, view=replace(config.view, size=(64, 40)))
    anew = paint_view(prepare(SCENE, sized, Report(), views=camera), Report())
    assert seen.rgb.shape == (40, 64, 3)
    assert np.array_equal(seen.rgb, anew.rgb)


@pytest.mark.parametrize("look", ["oil", "charcoal"])
def test_coats_along_a_path_have_the_options_of_paths(look):
    config = config_of(look)
    still = prepare(SCENE, config, Report(), asks=(*PICTURE, "scene"))
    path = prepare(SCENE, config, Report(), views=PathConfig(orbit=4))
    assert path.path is not None
    moving = along(still, config, path.path, Report())
    # Which marks charcoal needs depends on what the views show.
    ours, theirs = ({coat.name: coat for coat in one.painting.coats} for one in (moving, path))
    both = [name for name in ours if name in theirs]
    assert [name for name in theirs if name in ours] == both
    assert len(both) >= (3 if look == "charcoal" else len(theirs))
    for name in both:
        assert ours[name].options == theirs[name].options
    for name in ("lamp", "is_transparent", "is_moving"):
        assert getattr(moving.painting, name) == getattr(path.painting, name)
    assert {coat.options.lock for coat in moving.painting.coats if coat.texture.is_directed} == {"track"}
    assert not any(coat.fields for coat in moving.painting.coats)  # by which a film would be another one
