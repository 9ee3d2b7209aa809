"""Marks continued in strokes that are like those below them, on a plane of two colors."""

from dataclasses import replace

import numpy as np

import brushgs as bg
from brushgs.passes.form.planes import Planes
from brushgs.passes.marks.learn import covered, learn
from brushgs.values.camera import FirstView
from brushgs.values.colors import oklab_of
from brushgs.values.marks import NO_TILE, Marks
from brushgs.values.sh import base_colors
from tests.kit.for_each import for_each
from tests.passes.scenes import gaussians_at

GREY, RED, BLUE = (0.6, 0.6, 0.6), (0.7, 0.2, 0.2), np.array([0.1, 0.2, 0.9])
SIDE, STEP = 24, 0.1
IS_RED = np.repeat(np.arange(SIDE) >= SIDE // 2, SIDE)  # the right half


def plane() -> bg.Gaussians:
    """Strokes along x on the plane z = 0, the left half grey and the right half red."""
    means = np.column_stack([*np.indices((SIDE, SIDE)).reshape(2, -1), np.zeros(SIDE * SIDE)]) * STEP
    return gaussians_at(means, (0.05, 0.025, 0.001), np.where(IS_RED[:, None], RED, GREY), opacity=1)


def marks_at(places, *, direction=(0, 1, 0), color=BLUE, opacity: float = 1.0, length: float = 0.3) -> Marks:
    means = np.asarray(places, float).reshape(-1, 3)
    rows = np.ones((len(means), 1))
    columns = rows * direction, rows * (0, 0, 1), length * rows[:, 0], 0.1 * rows[:, 0]
    return Marks(means, *columns, rows * color, opacity * rows[:, 0], np.full(len(means), NO_TILE))


STROKES = plane()
VIEW = FirstView(STROKES.means.astype(np.float64), np.array([0.0, -1.0, 0.0]), 0.0, 0.0)
GREYS = STROKES.means[~IS_RED][:: 3 * SIDE + 5]  # a few of them


def continued(marks: Marks, strokes: bg.Gaussians = STROKES) -> bg.Gaussians:
    learned = learn(strokes, marks, VIEW)
    assert learned is not None
    return learned(strokes)[0]


def test_like_strokes_follow_and_others_keep_every_bit():
    after = continued(marks_at(STROKES.means[~IS_RED][::9]))
    away = np.linalg.norm(oklab_of(base_colors(after.sh)) - oklab_of(BLUE[None]), axis=1)
    assert away[~IS_RED].max() < 0.02
    along = np.abs(Planes.of(after).axes[:, 0, 1])
    assert along[~IS_RED].min() > np.cos(np.radians(5))
    for name in STROKES.columns():
        np.testing.assert_array_equal(getattr(after, name)[IS_RED], getattr(STROKES, name)[IS_RED])


def test_two_kinds_are_painted_in_two_ways():
    yellow = {"direction": (0.6, 0.8, 0), "color": (0.9, 0.9, 0.1)}
    places = STROKES.means[~IS_RED][::9], STROKES.means[IS_RED][::9]
    after = continued(marks_at(places[0]) + marks_at(places[1], **yellow))
    along = Planes.of(after).axes[:, 0]
    assert np.median(np.abs(along[IS_RED] @ (0.6, 0.8, 0))) > np.cos(np.radians(5))
    assert np.median(np.abs(along[~IS_RED] @ (0, 1, 0))) > np.cos(np.radians(5))
    rgb = base_colors(after.sh)
    assert (np.median(rgb[IS_RED], axis=0) > (0.8, 0.8, 0)).all()
    assert np.median(rgb[~IS_RED], axis=0)[2] > 0.8


@for_each(
    "marks",
    [
        marks_at(GREYS[:1]),  # no variance
        marks_at(np.repeat(GREYS[:1], 2000, axis=0)),  # of rank one
        marks_at(GREYS, length=0.1),  # round ones have no direction
        marks_at(GREYS, opacity=0.4),
    ],
)
def test_scarce_and_equal_marks_give_finite_strokes(marks):
    after = continued(marks)
    for name in STROKES.columns():
        assert np.isfinite(getattr(after, name)).all()
    ratio = after.scales / STROKES.scales
    assert 0.69 <= ratio.min() <= ratio.max() <= 2.01
    np.testing.assert_array_equal(after.sh[IS_RED], STROKES.sh[IS_RED])


def test_round_marks_turn_nothing_and_a_thin_one_counts_for_the_nearest_stroke():
    after = continued(marks_at(GREYS, length=0.1))
    np.testing.assert_array_equal(after.quats, STROKES.quats)
    between = GREYS[:1] + np.array([0.04, 0.03, 0.0])
    thin = replace(marks_at(between), widths=np.array([0.01]))
    assert len(covered(STROKES, thin).rows) == 1


def test_nothing_is_learnt_of_marks_beside_all_strokes_or_without_strokes():
    assert learn(STROKES, marks_at([[9, 9, 9]]), VIEW) is None
    assert learn(STROKES, marks_at(GREYS, opacity=0.0), VIEW) is None
    assert learn(STROKES.take(np.zeros(0, np.intp)), marks_at(GREYS), VIEW) is None
