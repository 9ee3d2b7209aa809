"""Turning strokes of trained scenes is for the look; it costs next to nothing in likeness."""

import pytest

import brushgs as bg
from tests.passes.scenes import gain
from tests.scenes import real_scene


@pytest.mark.parametrize("name", ["koala.ply", "truck.splat"])
def test_strokes_that_run_along_the_form_are_as_near_to_the_plain_picture(name):
    """Over a ring of 8 views of 400x300 koala loses 0.09 dB and truck gains 0.09; signs alone do 0.1."""
    scene = bg.prune(bg.load(real_scene(name)))
    strokes = bg.cluster(scene, 2000)
    turned = bg.orient(strokes, scene)
    assert gain(scene, strokes, turned) > -0.2
