"""What is learned of the marks of four paintings whose marks are known, and brushes cut out of them."""

import numpy as np
import pytest

from brushgs.passes.style.marks import learn_marks
from brushgs.values.colors import rgb_of
from tests.kit.for_each import for_each
from tests.kit.mark_paintings import KINDS, learned, paint

# Mean angle, degrees, between learned and true directions: dabs are nearly as wide as long, and washes lie
# over each other, which shows edges across them as well.
WITHIN = {"hatching": 4, "swirls": 9, "dabs": 20, "washes": 30}


@pytest.mark.parametrize("name", KINDS)
def test_sizes_directions_and_ground_are_near_the_truth(name):
    marks, kind = learned(name), KINDS[name]
    assert 1 / 1.4 < marks.length / kind.length < 1.4
    assert 1 / 1.5 < marks.aspect / kind.aspect < 1.5
    found = marks.directions.astype(np.float64)
    rows, columns = found.shape[:2]
    y, x = (np.mgrid[:rows, :columns] + 0.5) / min(rows, columns)
    angles = 2 * kind.angles(x, y)
    clear = np.hypot(found[..., 0], found[..., 1])
    cosines = (found[..., 0] * np.cos(angles) + found[..., 1] * np.sin(angles)) / np.maximum(clear, 1e-9)
    away = np.degrees(0.5 * np.arccos(np.clip(cosines, -1, 1)))
    assert np.average(away, weights=clear) < WITHIN[name]
    assert clear.max() <= 1 + 1e-6
    assert clear.mean() > 0.5
    if kind.shows_ground:
        np.testing.assert_allclose(marks.ground, rgb_of(kind.ground), atol=0.02)
    else:
        assert marks.ground is None


def aspects_of(images):
    """Length over width of the paint, by its second moments."""
    found = []
    for image in images:
        v, u = np.mgrid[: image.shape[0], : image.shape[1]].astype(np.float64)
        weights = image / image.sum()
        spread = [np.sqrt((weights * (place - (weights * place).sum()) ** 2).sum()) for place in (u, v)]
        found.append(spread[0] / spread[1])
    return np.array(found)


@pytest.mark.parametrize(
    ("name", "low", "high"), [("hatching", 4, 11), ("swirls", 3, 6), ("dabs", 1, 2.2), ("washes", 0, 20)]
)
def test_a_few_small_brushes_of_the_aspect_of_marks_are_cut_out_none_in_a_rectangle(name, low, high):
    images = learned(name).brushes
    assert 4 <= len(images) <= 8
    assert sum(image.nbytes for image in images) < 70_000
    assert low < np.median(aspects_of(images)) < high
    for image in images:
        assert image.dtype == np.uint8
        assert max(2 * image.shape[0], image.shape[1]) <= 128
        assert image.max() > 240
        for edge in (image[0], image[-1], image[:, 0], image[:, -1]):
            assert edge.mean() < 0.35 * 255
        assert image[[0, 0, -1, -1], [0, -1, 0, -1]].max() < 100


@for_each("channels", [1, 4])
def test_pictures_of_any_channels_are_taken(channels):
    rgb = paint("hatching", size=(48, 40))
    image = rgb if channels > 2 else rgb.mean(axis=2, keepdims=True)
    if channels == 4:
        image = np.concatenate([image, np.ones((40, 48, 1), np.float32)], axis=2)
    marks = learn_marks(np.ascontiguousarray(image))
    assert 0 < marks.length <= 1 <= marks.aspect <= 20


@for_each(
    ("shape", "message"),
    [((64, 64, 5), "1 to 4 channels"), ((64, 31, 3), "got 3 in 31x64"), ((64, 64, 3), "one even color")],
)
def test_what_is_no_painting_is_refused(shape, message):
    with pytest.raises(ValueError, match=message):
        learn_marks(np.full(shape, 0.4, np.float32))
