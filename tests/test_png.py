"""Pixels in memory become a PNG: decoded by Pillow and by OpenImageIO they are the same."""

from io import BytesIO

import numpy as np
import OpenImageIO
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image

from brushgs.values.png import png_bytes
from tests.kit.for_each import for_each


@settings(max_examples=40, deadline=None)
@given(arrays(np.uint8, st.tuples(st.integers(1, 9), st.integers(1, 9), st.sampled_from([3, 4]))))
def test_pixels_come_back_bit_for_bit(pixels):
    with Image.open(BytesIO(png_bytes(pixels))) as picture:
        picture.load()  # Pillow checks the sums of chunks here
        assert picture.mode == {3: "RGB", 4: "RGBA"}[pixels.shape[2]]
        np.testing.assert_array_equal(np.asarray(picture), pixels)


@for_each("channels", [3, 4])
def test_openimageio_reads_the_same(channels, tmp_path):
    pixels = np.random.default_rng(0).integers(0, 256, (7, 5, channels), dtype=np.uint8)
    (tmp_path / "a.png").write_bytes(png_bytes(pixels))
    config = OpenImageIO.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    image = OpenImageIO.ImageInput.open(str(tmp_path / "a.png"), config)
    np.testing.assert_array_equal(image.read_image("uint8"), pixels)
    image.close()
