"""Pictures in other sizes, against scikit-image."""

import numpy as np
from skimage.transform import resize as expected_resize

from brushgs.formats.pictures.images import resize
from tests.kit.for_each import for_each

NAMES = {"mirror": "reflect", "nearest": "edge"}  # in scikit-image


@for_each("dtype", [np.float32, np.float64])
@for_each("edges", NAMES)
@for_each(("width", "height"), [(30, 20), (61, 47), (7, 20), (40, 3), (1, 1), (29, 21)])
def test_numbers_are_those_of_scikit_image(width, height, edges, dtype):
    picture = np.random.default_rng(0).uniform(0, 1, (20, 30, 3)).astype(dtype)
    resized = resize(picture, width, height, edges=edges)
    is_smaller = width < 30 or height < 20
    options = {"order": 1, "mode": NAMES[edges], "anti_aliasing": is_smaller, "preserve_range": True}
    np.testing.assert_array_equal(resized, expected_resize(picture, (height, width), **options))
    assert resized.dtype == dtype
