import numpy as np

from brushgs.passes.groups import Groups, add_rows, compacted
from tests.kit.for_each import for_each

SPARSE = np.array([7, -3, 10**12, 7, -3, 0])
LABELS = [
    SPARSE,
    SPARSE.astype(np.int32) % 50,
    np.zeros(0, int),
    np.array([-128, 127, 5], np.int8),
    np.array([2**63, 2**63 + 5], np.uint64),
]


LABELLED = np.random.default_rng(0).integers(0, 17, 1000).astype(np.int32)
LABELLED[LABELLED == 4] = 5  # a label without rows


def test_groups_hold_the_rows_of_each_label_in_order():
    groups = Groups.of(LABELLED, 17)
    for label in range(17):
        rows = groups.rows[groups.begins[label] : groups.begins[label + 1]]
        np.testing.assert_array_equal(rows, np.flatnonzero(label == LABELLED))
    np.testing.assert_array_equal(groups.sizes, np.bincount(LABELLED, minlength=17))
    assert len(groups) == 17


@for_each("dtype", [np.float32, np.float64])
@for_each("width", [1, 9, 48])
@for_each("num_threads", [1, 3])
def test_sums_are_those_of_bincount_bit_for_bit(dtype, width, num_threads):
    rng = np.random.default_rng(1)
    values, weights = rng.normal(size=(1000, width)).astype(dtype), rng.random(1000)
    totals, sums = Groups.of(LABELLED, 17).totals_and_sums(values, weights, num_threads)
    np.testing.assert_array_equal(totals, np.bincount(LABELLED, weights, 17))
    for column, found in zip(values.T, sums.T, strict=True):
        np.testing.assert_array_equal(found, np.bincount(LABELLED, weights * column, 17))


@for_each("dtype", [np.float32, np.float64])
@for_each("shape", [(), (1,), (3,), (2, 3)])
def test_rows_are_added_to_the_rows_they_belong_to_bit_for_bit(dtype, shape):
    rng = np.random.default_rng(0)
    rows = rng.integers(0, 20, 500).astype(np.int32)  # many come twice
    values = rng.normal(size=(500, *shape)).astype(dtype)
    totals = rng.normal(size=(25, *shape))
    expected = totals.copy()
    np.add.at(expected, rows, values)
    add_rows(totals, rows, values)
    np.testing.assert_array_equal(totals, expected)


@for_each("labels", LABELS)
def test_labels_are_numbered_anew_in_their_order(labels):
    expected, compact = np.unique(labels, return_inverse=True)
    found, num = compacted(labels)
    np.testing.assert_array_equal(found, compact)
    assert num == len(expected)
