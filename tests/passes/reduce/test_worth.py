from brushgs.passes.reduce.worth import worth_keeping
from tests.passes.form.test_solid import joined, layer
from tests.passes.scenes import gaussians_at


def stroke(place, size, opacity):
    return gaussians_at([place], size, opacity=opacity)


WALL = layer(8, opacity=0.9, size=0.6)


def dropped(*others):
    """Which of some strokes are dropped beside a wall of 64, of which none is."""
    keep = worth_keeping(joined(WALL, *others))
    assert keep[:64].all()
    return [bool(value) for value in ~keep[64:]]


def test_faint_strokes_and_veils_are_dropped_where_paint_covers_and_when_they_are_alone():
    assert dropped(stroke((3.5, 3.5, 0.1), 0.4, 0.05)) == [True]
    assert dropped(stroke((3.5, 3.5, 0.1), 3.0, 0.2)) == [True]  # a veil
    assert dropped(stroke((3.5, 3.5, 0.1), 0.6, 0.2)) == [False]  # neither
    assert dropped(stroke((3.5, 3.5, 8.0), 8.0, 0.2)) == [True]  # over the wall
    assert dropped(stroke((20.0, 3.5, 0.0), 9.0, 0.2)) == [True]  # a pane of glass in the air
    assert dropped(stroke((8.0, 3.5, 0.0), (0.6, 0.6, 0.01), 0.1)) == [False]  # thin, but part of the wall
    assert dropped(stroke((9.0, 3.5, 0.0), (0.6, 0.6, 0.01), 0.1)) == [True]  # fog


def test_surfaces_of_many_veils_masts_and_wires_are_kept():
    veils = [stroke((12 + 0.01 * k, 3.5, 0.001 * k), (0.9, 0.9, 0.01), 0.1) for k in range(40)]
    assert dropped(*veils) == [False] * 40
    assert dropped(veils[0]) == [True]
    mast = [stroke((3.5, 3.5, 2.0 * k), (0.02, 0.02, 0.8), 0.5) for k in range(4)]
    assert dropped(*mast) == [False] * 4
    wire = [stroke((2.5 * k, 3.5, 30.0), (0.8, 0.01, 0.01), 0.4) for k in range(8)]
    assert dropped(*wire) == [False] * 8


def test_a_scene_of_haze_or_without_bodies_is_kept():
    scattered = layer(5, opacity=0.5, size=0.01)
    for scene in (layer(8, opacity=0.03, size=0.6), scattered, layer(3, opacity=0.0)):
        assert worth_keeping(scene).all()
