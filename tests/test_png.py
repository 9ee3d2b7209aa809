"""Pixels in memory become a PNG: decoded by Pillow and by OpenImageIO they are the same."""

from io import BytesIO

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image

from brushgs.values.png import png_bytes


@settings(max_examples=40, deadline=None)
@given(arrays(np.uint8, st.tuples(st.integers(1, 9), st.integers(1, 9), st.sampled_from([3, 4]))))
def test_pixels_come_back_bit_for_bit(pixels):
    with Image.open(BytesIO(png_bytes(pixels))) as picture:
        picture.load()  # Pillow checks the sums of chunks here
        assert picture.mode == {3: "RGB", 4: "RGBA"}[pixels.shape[2]]
        np.testing.assert_array_equal(np.asarray(picture), pixels)
