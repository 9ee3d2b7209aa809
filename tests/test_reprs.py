"""Values with arrays in them say in one line what they are."""

import numpy as np

import brushgs as bg
from brushgs.rendering.plain import PlainViews
from brushgs.values.style import NamedColor, StyleMarks, StylePalette


def test_strokes_and_sets_are_named():
    coverage = np.full((9, 25), 255, np.uint8)
    plain = bg.StrokeTexture.from_coverage(coverage, name="mine")
    assert repr(plain) == "StrokeTexture('mine', 25x9)"
    ridged = bg.StrokeTexture.from_coverage(coverage, height=np.full((9, 25), 0.5, np.float32), name="mine")
    assert repr(ridged) == "StrokeTexture('mine', 25x9, height)"
    assert repr(bg.StrokeTexture.open("gaussian")) == "StrokeTexture('gaussian')"
    assert (
        repr(bg.BrushSet((plain, bg.StrokeTexture.from_coverage(coverage, name="b")))) == "BrushSet(mine, b)"
    )


def test_a_look_is_named_with_its_title():
    look = bg.Look.open("charcoal")
    assert repr(look) == f"Look('charcoal', {look.title!r})"


def test_a_style_says_what_is_in_it():
    color = NamedColor("red", np.array([1.0, 0, 0]), 1.0, np.zeros((4, 3), np.float32))
    assert repr(bg.Style("a")) == "Style('a')"
    assert repr(bg.Style("a", StylePalette((color, color)))) == "Style('a', 2 colours)"
    marks = StyleMarks(0.1, 3, np.zeros((2, 2, 2), np.float32), brushes=(np.zeros((2, 2), np.uint8),) * 3)
    assert repr(bg.Style("a", StylePalette((color,)), marks)) == "Style('a', 1 colours, marks, 3 brushes)"


def test_moving_scenes_and_views_are_counted():
    def never(time):
        raise AssertionError

    formula = bg.MovingScene(2.5, True, never, resting=np.array([True, False, True, True]))
    assert repr(formula) == "MovingScene(2.5 s, any moment, rows correspond, 75% of 4 rest)"
    assert repr(bg.MovingScene(1.0, False, never, times=np.arange(3.0))) == "MovingScene(1 s, 3 moments)"
    camera = bg.Camera(np.eye(4), np.eye(3), 8, 6)
    frame = bg.Frame(np.zeros((6, 8, 3), np.float32), np.zeros((6, 8), np.float32))
    assert repr(PlainViews((camera,) * 2, (frame,) * 2)) == "PlainViews(2 views, 8x6)"
