"""`check`: shapes by letter, and the sentence that names what is wrong."""

import re

import numpy as np
import pytest

from brushgs.values.arrays import check, gaussian_weights
from tests.kit.for_each import for_each


@for_each(
    ("shapes", "specifications", "message"),
    [
        ([(812, 3)], ["M 2"], "here: a must have shape [M=812, 2], got [812, 3]"),
        ([(5, 2), (4,)], ["M 2", "M"], "here: b must have shape [M=5], got [4]"),
        ([(5,)], ["M 2"], "here: a must have shape [M=5, 2], got [5]"),
        ([(5, 2, 1)], ["M 2"], "here: a must have shape [M=5, 2], got [5, 2, 1]"),
        ([()], ["M"], "here: a must have shape [M], got []"),
        ([(2, 3)], ["n n"], "here: a must have shape [n=2, n=2], got [2, 3]"),
        ([(4, 3)], ["4 4"], "here: a must have shape [4, 4], got [4, 3]"),
    ],
)
def test_a_wrong_shape_is_named_with_the_expected_one(shapes, specifications, message):
    arrays = dict(zip("ab", zip(map(np.zeros, shapes), specifications, strict=True), strict=False))
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        check("here", **arrays)


@for_each("value", [[1.0, 2.0], None, 3.0, "text"])
def test_what_is_no_array_is_named_by_its_type(value):
    with pytest.raises(TypeError, match=f"^here: a must be a NumPy array, got {type(value).__name__}$"):
        check("here", a=(value, "M"))


def test_empty_arrays_have_shapes_too():
    check("here", a=(np.zeros((0, 3)), "N 3"), b=(np.zeros((0, 16, 3)), "N k 3"))
    with pytest.raises(ValueError, match=re.escape("b must have shape [N=0], got [1]")):
        check("here", a=(np.zeros((0, 3)), "N 3"), b=(np.zeros(1), "N"))


def test_weights_of_a_blur_are_gaussian_and_none_is_so_small_that_products_are_subnormal():
    weights = gaussian_weights(90, 1.5)
    row = np.exp(-0.5 * (np.arange(90) / 1.5) ** 2)
    np.testing.assert_array_equal(weights[0], np.where(row < 1e-40, 0, row))
    np.testing.assert_array_equal(weights, weights.T)
    assert (weights == 0).any()
    assert weights[weights > 0].min() >= 1e-40
    coarse = gaussian_weights(90, 1.5, least=0.1)[0]
    np.testing.assert_array_equal(coarse, np.where(row < 0.1, 0, row))
