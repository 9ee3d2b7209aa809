"""Parts of a scene in words."""

import numpy as np
import pytest

import brushgs as bg
from brushgs.options.region import Region
from brushgs.refine.select import select_strokes
from brushgs.sh import C0


def scene():
    means = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [5, 5, 5]], dtype=np.float32)
    colors = np.array([[1, 0, 0], [0.9, 0.1, 0], [0, 0, 1], [0, 1, 0]], dtype=np.float32)
    return bg.Gaussians(
        means,
        np.tile(np.array([1, 0, 0, 0], np.float32), (4, 1)),
        np.ones((4, 3), np.float32),
        np.ones(4, np.float32),
        ((colors - 0.5) / np.float32(C0))[:, None],
    )


@pytest.mark.parametrize(
    ("text", "inside"),
    [
        ("box:-1,-1,-1,1,1,1", [1, 1, 0, 0]),
        ("box:1,2,1,-1,-1,-1", [1, 1, 1, 0]),
        ("sphere:0,0,0,1.5", [1, 1, 0, 0]),
        ("sphere: 5, 5, 5, 0.1", [0, 0, 0, 1]),
        ("colour:#ff0000,0.2", [1, 1, 0, 0]),
        ("colour:#0000ff,0.01", [0, 0, 1, 0]),
    ],
)
def test_a_region_holds_what_lies_in_it(text, inside):
    assert select_strokes(Region.parse(text), scene()).tolist() == [bool(value) for value in inside]


def test_no_region_is_all():
    assert select_strokes(None, scene()).all()


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("cone:1,2,3", r"region must be box:x0,y0,z0,x1,y1,z1, sphere:x,y,z,radius, colour:#rrggbb,distance"),
        ("box:1,2,3", "region must be box"),
        ("sphere:0,0,0,x", "'x' must be a number"),
        ("sphere:0,0,0,-1", "must be above 0, got -1"),
        ("sphere:0,0,nan,1", "'nan' must be a number"),
        ("colour:red,0.1", "the colour of a region must be #rrggbb, got 'red'"),
    ],
)
def test_what_means_nothing_is_refused_in_a_sentence(text, sentence):
    with pytest.raises(ValueError, match=sentence):
        Region.parse(text)


def test_a_region_without_strokes_is_refused():
    with pytest.raises(ValueError, match="no stroke lies in it"):
        select_strokes(Region.parse("sphere:100,0,0,1"), scene())
