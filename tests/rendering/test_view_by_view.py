"""Views of a small scene are looked at side by side, those of a large one in turn; results are the same."""

import threading

import pytest

from brushgs.core import threads
from brushgs.rendering.view_by_view import MOST_ROWS, view_by_view


def test_views_of_a_small_scene_are_looked_at_together():
    meeting = threading.Barrier(2, timeout=30)

    def meet(view):
        meeting.wait()
        return view

    with threads.at_most(2):
        assert list(view_by_view(meet, range(4), MOST_ROWS)) == [0, 1, 2, 3]


@pytest.mark.parametrize("num_threads", [1, 5])
def test_a_view_of_a_large_scene_has_all_threads_for_itself(num_threads):
    def look(view):
        return view, threading.get_ident(), threads.num_threads_or_default(None)

    here = threading.get_ident()
    seen = list(view_by_view(look, "abc", MOST_ROWS + 1, num_threads))
    assert seen == [(view, here, num_threads) for view in "abc"]
