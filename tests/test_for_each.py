"""What folds the rows of a law into one case runs all of them, and names the one that breaks it."""

import os

import pytest

from tests.kit.for_each import for_each


def test_every_combination_of_rows_is_run_and_fixtures_are_passed_on():
    seen = []

    @for_each("a", [1, 2])
    @for_each(("b", "c"), [(3, 4), (5, 6)])
    def law(a, b, c, fixture):
        seen.append((a, b, c, fixture))

    law(fixture="f")
    assert seen == [(1, 3, 4, "f"), (1, 5, 6, "f"), (2, 3, 4, "f"), (2, 5, 6, "f")]


def test_what_a_row_patches_is_undone_before_the_next(monkeypatch):
    seen = []

    @for_each("a", [1, 2])
    def law(a, monkeypatch):
        seen.append(os.environ.get("OF_A_ROW"))
        monkeypatch.setenv("OF_A_ROW", str(a))

    law(monkeypatch=monkeypatch)
    assert seen == [None, None]


def test_the_row_that_breaks_the_law_is_named():
    @for_each("a", [1, 2, 3])
    def law(a):
        assert a < 2

    with pytest.raises(AssertionError) as caught:
        law()
    assert caught.value.__notes__ == ["in the row {'a': 2}"]


def test_a_skipped_row_hides_no_other():
    @for_each("a", [1, pytest.param(2), 3])
    def law(a):
        if a < 3:
            pytest.skip("too small")
        raise ValueError(a)

    with pytest.raises(ValueError, match="3"):
        law()

    @for_each("a", [1, 2])
    def none(a):
        pytest.skip("too small")

    with pytest.raises(pytest.skip.Exception):
        none()
