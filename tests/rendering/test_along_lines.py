"""Lines of films show as curves: no piece comes or goes alone."""

import numpy as np

from brushgs.rendering.along_lines import along_lines
from brushgs.rendering.depth_test import DepthTest
from brushgs.values.boxes import Boxes

PIECES, LENGTH = 20, 8  # of a horizontal curve at depth 1, px
TOLERANCE = 0.05


def curve(rows=PIECES):
    centers = np.stack([LENGTH * (np.arange(rows) + 0.5), np.full(rows, 5.0)], axis=1)
    half_extents, ones = np.tile([LENGTH / 2, 1.0], (rows, 1)), np.ones(rows)
    return Boxes(centers, half_extents, 0 * ones, ones, np.zeros((rows, 3)), ones, np.arange(rows))


def laid(limit, boxes=None, chains=None):
    """Opacities and tolerances over the limit of each piece."""
    boxes = curve() if boxes is None else boxes
    chains = np.zeros(PIECES, np.intp) if chains is None else chains
    picture = np.tile(np.repeat(limit, LENGTH), (10, 1))
    shown, test = along_lines(boxes, DepthTest(picture, np.full(len(boxes), TOLERANCE)), chains)
    return shown.opacities, test.tolerance


def limits(**others):
    limit = np.full(PIECES, 2.0)
    for piece, depth in others.items():
        limit[int(piece[1:])] = depth
    return limit


def test_a_stroke_in_front_of_one_piece_does_not_cut_the_curve():
    opacities, tolerance = laid(limits(p10=0.94))  # behind by 1.2 tolerances: alone it would be gone
    assert opacities.min() > 0.95
    assert 0.5 * tolerance[10] > 1 - 0.94


def test_one_piece_of_a_hidden_curve_stays_hidden():
    hidden = np.full(PIECES, 0.9)
    hidden[10] = 2.0
    opacities, tolerance = laid(hidden)
    assert opacities.max() < 0.05
    assert tolerance.max() < 1.1 * TOLERANCE


def test_a_curve_that_runs_behind_a_surface_ends_there_and_other_curves_do_not_count():
    limit = limits(**{f"p{piece}": 0.5 for piece in range(10, PIECES)})
    opacities, _ = laid(limit)
    assert opacities[:8].min() > 0.95
    assert opacities[13:].max() < 0.05
    chains = np.repeat([0, 1], 10)
    opacities, _ = laid(limit, chains=chains)
    np.testing.assert_allclose(opacities, [1.0] * 10 + [0.0] * 10, atol=0.01)


def test_the_order_of_boxes_does_not_matter_and_none_are_none():
    limit = limits(**{f"p{piece}": 0.97 - 0.01 * piece for piece in range(5, 12)})
    order = np.random.default_rng(0).permutation(PIECES)
    opacities, tolerance = laid(limit)
    shuffled = laid(limit, curve().take(order))
    np.testing.assert_allclose(shuffled[0], opacities[order])
    np.testing.assert_allclose(shuffled[1], tolerance[order])
    assert len(laid(limit, curve(0))[0]) == 0
