"""Cases by pairs hold every pair of values."""

from itertools import combinations, product

from tests.pairs import pairs_of


def test_every_pair_of_values_is_in_a_case():
    axes = "abcde", (None, 1, 2), "wxyz"
    cases = pairs_of(*axes)
    assert len(cases) < 30  # of 60; 20 are the fewest
    assert set(cases) <= set(product(*axes))
    for (i, first), (j, second) in combinations(enumerate(axes), 2):
        assert {(case[i], case[j]) for case in cases} == set(product(first, second))
