"""The yardstick of `tests.bench.strokes`: views that no pass has used, and counts between two counts."""

import numpy as np
import pytest

from brushgs.cameras.around import near_views, ring_views, subject_ahead
from brushgs.cameras.first_view import framed_camera
from brushgs.cameras.framing import plain_first_view
from brushgs.options.painting import ViewConfig
from tests.bench.strokes import RING, TESTS, Row, ablation_table, equal_table, likeness_table, turned
from tests.scenes import still_life_of


@pytest.fixture(scope="module")
def view():
    return plain_first_view(still_life_of(2000))


def least_angle(camera, others):
    """Degrees between what a camera looks along and the nearest of others."""
    axes = np.stack([other.viewmat[2, :3] for other in others])
    return np.degrees(np.arccos(np.clip(axes @ camera.viewmat[2, :3], -1, 1))).min()


def test_no_pass_uses_a_view_of_the_unused_ring(view):
    config = ViewConfig(size=(80, 60))
    camera = framed_camera(view, config)
    used = [*near_views(camera, subject_ahead(camera, view)), *ring_views(view, 80, 60)]
    for place in (*TESTS[1:], *RING):
        assert least_angle(turned(view, config, (80, 60), *place), used) > 8
    assert least_angle(turned(view, config, (80, 60), *TESTS[0]), used) < 0.1  # the picture itself


def row(arm, count, psnr, ring, seconds, frame=0.01):
    return Row(arm, count, count, "flat", [psnr] * 3, [0.9] * 3, ring, 0.9, 0.01, {"cluster": seconds}, frame)


LADDER = [row("off", 2000, 20.0, 21.0, 1.0), row("off 4000", 4000, 22.0, 23.0, 2.0, 0.02)]


def cells_of(table, heading):
    return [cells[table[0].index(heading)] for cells in table[1:]]


def test_equal_likeness_lies_between_two_counts_by_its_logarithm():
    found = {"koala": [*LADDER, row("on", 2000, 21.0, 25.0, 1.5)]}
    table = equal_table(found)
    assert cells_of(table, "off takes for 0°") == ["2,800"]  # half way to twice as many
    assert cells_of(table, "for the ring") == ["above 4,000"]


def test_equal_seconds_take_the_largest_count_that_costs_no_more():
    for seconds, count in ((1.5, "2,000"), (2.5, "4,000"), (0.5, "-")):
        found = {"koala": [*LADDER, row("on", 2000, 21.0, 25.0, seconds)]}
        assert cells_of(equal_table(found), "off in equal seconds") == [count]


def test_the_ablation_is_the_change_by_leaving_a_measure_out():
    found = {
        "koala": [
            row("off", 6000, 20.0, 20.0, 1.0),
            row("on", 6000, 23.0, 22.0, 3.0),
            row("no splits", 6000, 22.5, 22.1, 2.0),
        ]
    }
    assert cells_of(ablation_table(found), "no splits") == ["-0.5; +0.1"]
    assert cells_of(ablation_table(found), "no streaks") == ["-"]
    assert cells_of(likeness_table(found), "0°") == ["20.0 -> 23.0"]
