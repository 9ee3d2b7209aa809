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


def labelled(num=1000, k=17, width=9, dtype=np.float32):
    rng = np.random.default_rng(0)
    labels = rng.integers(0, k, num).astype(np.int32)
    labels[labels == 4] = 5  # a label without rows
    return labels, rng.normal(size=(num, width)).astype(dtype), rng.random(num)


def test_groups_hold_the_rows_of_each_label_in_order():
    labels, _, _ = labelled()
    groups = Groups.of(labels, 17)
    for label in range(17):
        rows = groups.rows[groups.begins[label] : groups.begins[label + 1]]
        np.testing.assert_array_equal(rows, np.flatnonzero(labels == label))
    np.testing.assert_array_equal(groups.sizes, np.bincount(labels, minlength=17))
    assert len(groups) == 17


@for_each("dtype", [np.float32, np.float64])
@for_each("width", [1, 9, 48])
@for_each("num_threads", [1, 3])
def test_sums_are_those_of_bincount_bit_for_bit(dtype, width, num_threads):
    labels, values, weights = labelled(width=width, dtype=dtype)
    totals, sums = Groups.of(labels, 17).totals_and_sums(values, weights, num_threads)
    np.testing.assert_array_equal(totals, np.bincount(labels, weights, 17))
    for column in range(width):
        np.testing.assert_array_equal(sums[:, column], np.bincount(labels, weights * values[:, column], 17))


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
