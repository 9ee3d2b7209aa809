"""What surrounds a reproduction is left out; what belongs to a painting stays."""

import numpy as np

from brushgs.passes.style.margins import inside_margins
from tests.kit.for_each import for_each

RANDOM = np.random.default_rng(0)
PAINTING = RANDOM.random((90, 120, 3))


def surrounded(picture, widths, color, noise=0.0):
    """A picture with a margin; widths at the top, bottom, left and right."""
    top, bottom, left, right = widths
    sized = np.pad(picture, ((top, bottom), (left, right), (0, 0)))
    is_margin = np.ones(sized.shape[:2], bool)
    is_margin[top : top + picture.shape[0], left : left + picture.shape[1]] = False
    sized[is_margin] = np.array(color) + RANDOM.normal(0, noise, (is_margin.sum(), 3))
    return np.clip(sized, 0, 1).astype(np.float32)


def test_a_mount_within_a_frame_is_left_out_to_a_pixel():
    mounted = surrounded(PAINTING, (20, 30, 16, 16), (0.93, 0.91, 0.85))
    framed = surrounded(mounted, (10, 10, 10, 10), (0.4, 0.3, 0.1), noise=0.015)
    assert inside_margins(framed) == (slice(31, 119), slice(27, 145))  # one row of the painting may be mixed


def test_margins_of_a_large_picture_are_found_in_a_small_one():
    large = surrounded(PAINTING.repeat(15, axis=0).repeat(15, axis=1), (150, 150, 100, 100), (1, 1, 1))
    rows, columns = inside_margins(large)
    found = rows.start - 150, 1500 - rows.stop, columns.start - 100, 1900 - columns.stop
    assert 0 <= min(found) <= max(found) <= 5


KEPT = {
    "no margin": PAINTING,
    "a sky at three sides": surrounded(PAINTING, (40, 0, 20, 20), (0.6, 0.7, 0.8)),
    "four different sides": np.pad(surrounded(PAINTING, (9, 9, 9, 0), (1, 1, 1)), ((0, 0), (0, 9), (0, 0))),
    "one even color": np.full((90, 120, 3), 0.5),
    "a ramp": np.broadcast_to(np.linspace(0, 1, 120)[None, :, None], (90, 120, 3)),
    "a small figure on a large sheet": surrounded(PAINTING, (200, 200, 200, 200), (1, 1, 1)),
    "one pixel": np.ones((1, 1, 3)),
}


@for_each("name", KEPT)
def test_the_whole_picture_is_kept_with(name):
    picture = KEPT[name].astype(np.float32)
    height, width = picture.shape[:2]
    assert inside_margins(picture) == (slice(0, height), slice(0, width))
