import numpy as np
import pytest

from brushgs.first_view import find_first_view
from brushgs.first_view.front import LEAN, find_front, wrapped
from brushgs.first_view.sample import take_sample
from tests.first_view.scenes import about, moved, statue
from tests.kit.for_each import for_each

UP = np.array([0.0, -1.0, 0.0])


def apart(a, b):
    """Degrees between two azimuths in radians."""
    return abs(np.degrees(wrapped(a - b)))


@for_each("turn", [0, 77, 160, 235])
def test_the_front_is_where_the_face_is(turn):
    view = find_first_view(moved(statue(), rotation=about(UP, turn)))
    assert apart(view.front, np.radians(turn)) < 15
    assert apart(view.azimuth, view.front) == pytest.approx(np.degrees(LEAN))


def test_without_a_better_side_the_one_nearer_to_azimuth_zero_is_the_front():
    """A plinth is as good from behind: whichever plane is best, the front is not far behind azimuth 0."""
    plinth = statue().take(statue().means[:, 1] > -0.25)
    for turn in (0, 90, 180):
        front = find_front(take_sample(moved(plinth, rotation=about(UP, turn))), UP)
        assert np.cos(front.azimuth) > -0.3
        assert not front.is_sure
    assert not find_first_view(plinth, up=UP).is_front_sure
    assert find_first_view(statue()).is_front_sure
