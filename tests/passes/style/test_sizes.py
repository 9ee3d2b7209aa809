"""Sizes of marks that are known: dead leaves over what a painting may depict."""

import pytest

from brushgs.passes.color.color_space import oklab_planes
from brushgs.passes.style.sizes import mark_sizes
from tests.passes.style.dead_leaves import dead_leaves


def sizes_of(image):
    return mark_sizes(oklab_planes(image))


@pytest.mark.parametrize(
    ("length", "width", "kind"),
    [(0.03, 0.008, "shapes"), (0.06, 0.014, "flat"), (0.04, 0.02, "gradient"), (0.2, 0.028, "flat")],
)
def test_length_and_width_are_found_whatever_is_depicted(length, width, kind):
    found = sizes_of(dead_leaves(length, width, kind=kind))
    assert 1 / 1.25 < found.length / length < 1.25
    assert 1 / 1.25 < found.width / width < 1.25


def test_bands_of_narrow_marks_are_not_taken_for_marks():
    bands = dead_leaves(0.4, 0.05, jitter=0.12, straight=True)
    found = sizes_of(bands + dead_leaves(0.1, 0.012, jitter=0.03, seed=3, straight=True) - 0.5)
    assert found.width < 0.4 * 0.05


def test_areas_with_and_without_direction_are_told_apart():
    """Above long marks side by side, below round dabs."""
    image = dead_leaves(0.05, 0.012, straight=True)
    half = len(image) // 2
    image[half:] = dead_leaves(0.02, 0.0199, seed=1)[half:]
    found = sizes_of(image)
    assert found.coherent.lengths[1] > 1.5 * found.incoherent.lengths[1]
    for spectrum in (found.coherent, found.incoherent):
        assert list(spectrum.lengths) == sorted(spectrum.lengths)
        assert list(spectrum.widths) == sorted(spectrum.widths)
    assert found.coherent.share + found.incoherent.share == pytest.approx(1)
