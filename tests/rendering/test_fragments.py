"""What pixels are made of: the very fragments that the rasteriser blends."""

from dataclasses import replace

import numpy as np

import brushgs as bg
from brushgs.rendering import reference
from brushgs.rendering.fragments import TILE_HEIGHT, FragmentFinder, no_fragments, stacked
from brushgs.rendering.options import RenderOptions, rasterize_with
from brushgs.rendering.rasterize import RasterOptions
from tests.kit.for_each import for_each
from tests.pairs import pairs_of
from tests.rendering.paintings import BRUSHES, LOOKS, UNDERPAINT, depth_test_of, set_back, with_brushes
from tests.rendering.strokes import PATHS, bristles, random_boxes, softened, texture_of

LOOKS = {name: LOOKS[name] for name in ("plain", "underpainted", "streaked")}
LOOKS["all"] = {"underpaint": UNDERPAINT, "streaks": 0.3, "min_transmittance": 0.05}
COLUMNS = "starts", "marks", "weights", "shades", "is_underpaint"


def camera_of(width, height):
    return bg.Camera.look_at((0, 0, -6), (0, 0, 0), width=width, height=height)


def found_in(boxes, texture, width, height, in_front_of=None, rows=None, dpi=None, **options):
    how = RenderOptions(num_sigmas=2.0, **options)
    finder = FragmentFinder(boxes, camera_of(width, height), texture, how, in_front_of, dpi)
    return finder.find(*(rows or (0, height)))


def assert_as_defined(fragments, expected, rtol=1e-9, atol=1e-12):
    """The same fragments in each pixel, but for such as hide behind rounding."""
    counts = [len(pixel) for pixel in expected]
    np.testing.assert_array_equal(np.diff(fragments.starts), counts)
    flat = [fragment for pixel in expected for fragment in pixel]
    assert fragments.marks.tolist() == [fragment.row for fragment in flat]
    assert fragments.is_underpaint.tolist() == [fragment.is_underpaint for fragment in flat]
    for name in ("weights", "shades"):
        values = [getattr(fragment, name[:-1]) for fragment in flat]
        np.testing.assert_allclose(getattr(fragments, name), values, rtol=rtol, atol=atol, err_msg=name)


@for_each(("look", "softness", "is_tested"), pairs_of(LOOKS, (None, 0.1, 20.0), (False, True)))
def test_fragments_are_those_of_the_definition(look, softness, is_tested):
    boxes = set_back(random_boxes(50, 33, 17, sizes=(0.3, 40)), 1.0)
    boxes = boxes if softness is None else softened(boxes, softness)
    test = depth_test_of(boxes, 33, 17) if is_tested else None
    paths = {name: (boxes, texture_of(kind), filter) for name, (kind, filter) in PATHS.items()}
    paths["three"] = with_brushes(boxes), BRUSHES["three"], "mip"
    for path in paths if look == "plain" else ("mip", "three"):
        boxes, texture, filter = paths[path]
        options = {"filter": filter} | LOOKS[look]
        fragments = found_in(boxes, texture, 33, 17, test, **options)
        how = RasterOptions(height=17, width=33, in_front_of=test, **options)
        assert len(fragments) > 150
        assert_as_defined(fragments, reference.fragments(boxes, texture, how))


@for_each("dtype", [np.float32, np.float64])
@for_each("softness", [None, 0.4])
@for_each("look", [*LOOKS, "paper"])
def test_weights_make_up_the_picture(look, softness, dtype):
    dpi, look = (300.0, "streaked") if look == "paper" else (None, look)
    boxes = set_back(random_boxes(700, 90, 55, seed=4, sizes=(0.5, 60 if dpi else 20), dtype=dtype), 1.0)
    boxes = boxes if softness is None else softened(boxes, softness)
    options = RenderOptions(num_sigmas=2.0, **LOOKS[look])
    frame = rasterize_with(boxes, camera_of(90, 55), bristles(), options, dpi=dpi)
    fragments = found_in(boxes, bristles(), 90, 55, dpi=dpi, **LOOKS[look])
    precision = 50 * np.finfo(dtype).eps
    ones = np.ones((len(boxes), 1), dtype)
    np.testing.assert_allclose(fragments.sums(ones).reshape(55, 90), frame.alpha, atol=precision)
    shaded = replace(fragments, weights=fragments.weights * fragments.shades)
    np.testing.assert_allclose(shaded.sums(boxes.colors).reshape(55, 90, 3), frame.rgb, atol=precision)


@for_each("softness", [None, 0.4])
def test_neither_threads_nor_bands_change_a_bit(softness):
    boxes = set_back(random_boxes(2000, 90, 55, seed=5, sizes=(0.5, 9), dtype=np.float32), 1.0)
    boxes = boxes if softness is None else softened(boxes, softness)
    whole = found_in(boxes, bristles(), 90, 55, num_threads=1, **LOOKS["all"])
    threaded = found_in(boxes, bristles(), 90, 55, num_threads=5, **LOOKS["all"])
    rows = [(first, min(first + TILE_HEIGHT, 55)) for first in range(0, 55, TILE_HEIGHT)]
    bands = [found_in(boxes, bristles(), 90, 55, rows=band, **LOOKS["all"]) for band in rows]
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(threaded, name), getattr(whole, name), err_msg=name)
    for name in COLUMNS[1:]:
        joined = np.concatenate([getattr(band, name) for band in bands])
        np.testing.assert_array_equal(joined, getattr(whole, name), err_msg=name)
    counts = np.concatenate([np.diff(band.starts) for band in bands])
    np.testing.assert_array_equal(counts, np.diff(whole.starts))


def test_no_boxes_leave_no_fragments():
    boxes = random_boxes(3, 20, 10).take(slice(0))
    fragments = found_in(boxes, texture_of("gaussian"), 20, 10)
    assert len(fragments) == 0
    assert fragments.starts.tolist() == [0] * 201
    assert no_fragments(200, np.dtype(np.float64)).starts.tolist() == [0] * 201


def test_shares_are_sums_by_key_the_largest_first():
    boxes = random_boxes(200, 30, 20, seed=6)
    fragments = found_in(boxes, bristles(), 30, 20)
    keys = (np.arange(200) % 7).astype(np.int32)
    shares = fragments.shares(keys, 0.0)
    for pixel in range(0, 600, 7):
        own = slice(*fragments.starts[pixel : pixel + 2])
        sums = np.bincount(keys[fragments.marks[own]], fragments.weights[own], minlength=7)
        listed = slice(*shares.starts[pixel : pixel + 2])
        weights = shares.weights[listed]
        assert (np.diff(weights) <= 0).all()
        np.testing.assert_allclose(weights, sums[shares.keys[listed]], rtol=1e-12)
        assert len(weights) == np.count_nonzero(sums)
    few = fragments.shares(keys, 0.1)
    left_out = shares.weights.sum() - few.weights.sum()
    assert len(few.keys) < len(shares.keys)
    assert left_out < 0.1 * 600


def test_stacked_fragments_lie_behind_each_other():
    boxes = random_boxes(60, 30, 20, seed=7)
    front, back = (found_in(b, bristles(), 30, 20) for b in (boxes, boxes.take(slice(0, 30))))
    both = stacked([front, back.scaled(np.full(600, 0.25))])
    for pixel in range(0, 600, 11):
        mine, theirs = (slice(*f.starts[pixel : pixel + 2]) for f in (front, back))
        own = slice(*both.starts[pixel : pixel + 2])
        expected = np.concatenate([front.marks[mine], back.marks[theirs]])
        np.testing.assert_array_equal(both.marks[own], expected)
        weights = np.concatenate([front.weights[mine], 0.25 * back.weights[theirs]])
        np.testing.assert_array_equal(both.weights[own], weights)
