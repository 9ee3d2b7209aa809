"""Lost and found edges: soft where values meet, crisp in the focus, and nothing else changes."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.passes.form.edges import Around, find_edges, soften_edges
from brushgs.values.camera import Camera
from brushgs.values.sh import base_colors
from tests.passes.scenes import assert_same, gaussians_at, grid, on_sphere

VIEW = Camera.look_at((0, 0, -4), (0, 0, 0), width=320, height=240)
VIEWS = [VIEW] + [Camera.look_at((x, 0, -4), (0, 0, 0), width=320, height=240) for x in (-0.6, 0.6)]
GREY, NEAR, WHITE = 0.45, 0.12, 0.9


def discs(means, normals, size, grey):
    """Flat strokes that face along normals."""
    w = 1 + normals[:, 2]
    quats = np.stack([w, -normals[:, 1], normals[:, 0], 0 * w], axis=1)
    quats[w < 1e-6] = 0, 1, 0, 0
    sizes = size * np.array([1.0, 0.6, 0.05])
    return gaussians_at(means, sizes, np.reshape(grey, (-1, 1)), opacity=0.95, quats=quats)


def ball():
    """A grey sphere of radius 1: strokes all over it."""
    normals = on_sphere(1500)
    return discs(normals, normals, 0.07, GREY)


def wall():
    """Behind the ball: near its value to the left, white to the right."""
    means = grid(49, 6.0, 3.0)
    towards = np.tile([0.0, 0, -1], (len(means), 1))
    return discs(means, towards, 0.2, np.where(means[:, 0] < 0, GREY + NEAR, WHITE))


BALL, WALL = ball(), wall()
AROUND = Around(WALL)


def at_rim(side):
    """Strokes at the outline of the ball, to the left (-1) or right (1)."""
    return (np.abs(BALL.means[:, 2] + 0.25) < 0.15) & (side * BALL.means[:, 0] > 0.7)


@pytest.fixture(scope="module")
def edges():
    return find_edges(BALL, VIEWS, AROUND, focus=BALL.means[:, 0])


def test_edges_are_lost_where_values_meet_and_found_where_they_differ_in_the_focus(edges):
    assert np.median(edges.lost[at_rim(-1)]) > 0.4 > 10 * np.median(edges.lost[at_rim(1)])
    assert np.median(edges.found[at_rim(1)]) > 0.4 > 10 * np.median(edges.found[at_rim(-1)])


def test_lost_strokes_let_through_are_longer_along_the_outline_and_take_of_what_is_behind(edges):
    soft, rim, found = soften_edges(BALL, edges), at_rim(-1), at_rim(1)
    assert np.median(soft.opacities[rim] / BALL.opacities[rim]) < 0.6
    grown = soft.scales[rim] / BALL.scales[rim]
    assert grown.min() >= 1.0
    assert 1.1 < np.median(grown.max(axis=1)) < 1.31
    colors = base_colors(soft.sh)[rim]
    assert colors.min() > GREY - 1e-6
    assert GREY + NEAR / 4 < np.median(colors) < colors.max() < GREY + NEAR
    assert np.median((soft.scales[found] / BALL.scales[found]).min(axis=1)) < 0.95
    assert np.median(soft.opacities[found] / BALL.opacities[found]) > 0.95


def test_where_an_outline_is_lost_already_more_is_found_and_no_more_lost(edges):
    same = find_edges(BALL, VIEWS, Around(None, (GREY + 0.02,) * 3), focus=BALL.means[:, 0])
    assert same.lost.max() < 0.3 < edges.lost.max()
    assert same.found.sum() > 1.5 * edges.found.sum()
    apart = soften_edges(BALL, same)
    assert base_colors(apart.sh).min() < GREY - 0.01
    assert (apart.opacities > BALL.opacities).sum() > 30


def test_strength_is_how_much_is_done_and_nothing_else_changes(edges):
    one = replace(BALL, brushes=np.arange(len(BALL), dtype=np.uint8), antialiased=True)
    half, full = soften_edges(one, edges, 0.5), soften_edges(one, edges)
    for name in ("means", "quats", "brushes"):
        np.testing.assert_array_equal(getattr(half, name), getattr(one, name))
    assert half.antialiased
    inside = (BALL.means[:, 2] < 0) & (np.hypot(BALL.means[:, 0], BALL.means[:, 1]) < 0.5)
    assert inside.sum() > 80
    assert_same(full.take(inside), BALL.take(inside))
    assert soften_edges(BALL, edges, 0) is BALL
    rim = at_rim(-1)
    assert full.opacities[rim].mean() < half.opacities[rim].mean() < BALL.opacities[rim].mean()
    for strength in (-0.1, 1.1, np.nan):
        with pytest.raises(ValueError, match="strength must be in"):
            soften_edges(BALL, edges, strength)
    with pytest.raises(ValueError, match="lost must have shape"):
        soften_edges(BALL.take(slice(5)), edges)


def test_without_views_or_outline_strokes_stay():
    assert find_edges(BALL, [], AROUND) is None
    assert find_edges(BALL.take(slice(0)), VIEWS, AROUND) is None
    away = Camera.look_at((0, 0, -4), (0, 0, -8), width=320, height=240)
    assert find_edges(BALL, [away], AROUND) is None
    assert find_edges(BALL, [Camera.look_at((0, 0, -4), (0, 0, 0), width=400, height=8)], AROUND) is None
    assert soften_edges(BALL, None) is BALL
