"""Brushes that are cut out of paintings."""

import numpy as np
import pytest

from tests.kit.mark_paintings import KINDS, learnt


@pytest.fixture(scope="module")
def brushes():
    return {name: learnt(name).brushes for name in KINDS}


def aspects_of(images):
    """Length over width of the paint, by its second moments."""
    found = []
    for image in images:
        v, u = np.mgrid[: image.shape[0], : image.shape[1]].astype(np.float64)
        weights = image / image.sum()
        spread = [np.sqrt((weights * (place - (weights * place).sum()) ** 2).sum()) for place in (u, v)]
        found.append(spread[0] / spread[1])
    return np.array(found)


@pytest.mark.parametrize("name", KINDS)
def test_a_few_small_images_are_cut(brushes, name):
    images = brushes[name]
    assert 4 <= len(images) <= 8
    for image in images:
        assert image.dtype == np.uint8
        assert image.shape[0] <= 64
        assert image.shape[1] <= 128
        assert image.max() > 240
    assert sum(image.nbytes for image in images) < 70_000


@pytest.mark.parametrize(("name", "low", "high"), [("hatching", 4, 11), ("swirls", 3, 6), ("dabs", 1, 2.2)])
def test_brushes_have_the_aspect_of_the_marks(brushes, name, low, high):
    assert low < np.median(aspects_of(brushes[name])) < high
    assert low < KINDS[name].aspect < high


@pytest.mark.parametrize("name", KINDS)
def test_no_brush_ends_in_the_edge_of_a_rectangle(brushes, name):
    for image in brushes[name]:
        for edge in (image[0], image[-1], image[:, 0], image[:, -1]):
            assert edge.mean() < 0.35 * 255
        corners = image[[0, 0, -1, -1], [0, -1, 0, -1]]
        assert corners.max() < 100
