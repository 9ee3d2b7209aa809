"""A part of a picture is the cut of the whole, bit for bit."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.rendering.depth_test import DepthTest
from brushgs.rendering.rasterize import rasterize
from brushgs.rendering.streaks import BRISTLE_MM
from brushgs.rendering.surface import flat, linen, paper
from brushgs.values.frame import Frame
from brushgs.values.layers import DeepSamples, Matte
from brushgs.values.part import Part
from tests.kit.for_each import for_each
from tests.rendering.paintings import PLANES, SOLID, painting_of, relieved
from tests.rendering.strokes import boxes_of, ridges

WIDTH, HEIGHT = 173, 101
PARTS = [Part(0, 0, 32, 16), Part(64, 32, 64, 48), Part(96, 80, 77, 21), Part(0, 48, WIDTH, 16)]
KINDS = ["plain", "soft=0.4", "soft=0.4 raised layered", "raised", "glazed", "cut"]


def is_same(one: Frame, other: Frame) -> bool:
    """Whether frames agree in every bit."""
    planes = ((getattr(one, name), getattr(other, name)) for name in PLANES)
    return all(a is b is None or np.array_equal(a, b) for a, b in planes)


@for_each("dtype", [np.float32, np.float64])
@for_each("kind", KINDS)
def test_boxes_paint_a_part_as_the_whole(kind, dtype):
    painting = painting_of(f"mip {kind}", 400, WIDTH, HEIGHT, sizes=(0.3, 40), dtype=dtype)
    options = {"dpi": 300.0, "streaks": 0.3} if kind == "raised" else {}
    whole, test = painting.frame(**options), painting.options.get("in_front_of")
    for part in PARTS:
        seen = None if test is None else DepthTest(test.limit[part.rows, part.columns], test.tolerance)
        assert is_same(painting.frame(in_front_of=seen, part=part, **options), whole.cut(part))


@for_each("part", [Part(8, 0, 32, 16), Part(0, 8, 32, 16), Part(0, 0, 40, 16), Part(160, 0, 32, 16)])
def test_parts_off_the_tiles_or_the_picture_are_refused(part):
    with pytest.raises(ValueError, match=r"part must begin and end on tiles of 32 x 16 .* of 173 x 101"):
        rasterize(boxes_of([[9, 9]], (4, 4)), ridges(), width=WIDTH, height=HEIGHT, part=part)


@for_each("reach", [0, 1, 40, 1000])
def test_a_part_grows_by_its_reach_on_to_whole_tiles(reach):
    part = Part(70, 40, 11, 7)
    grown = part.grown(reach, WIDTH, HEIGHT)
    assert grown.left % 32 == grown.top % 16 == 0
    assert grown.is_in(WIDTH, HEIGHT)
    assert grown.left <= max(70 - reach, 0)
    assert grown.columns.stop >= min(81 + reach, WIDTH)
    assert grown.rows.stop >= min(47 + reach, HEIGHT)
    assert grown.grown(0, WIDTH, HEIGHT) == grown


@for_each("dpi", [None, 200.0])
@for_each("kind", [flat, linen, paper])
def test_a_part_of_a_ground_is_its_cut(kind, dpi):
    color = np.random.default_rng(0).uniform(0, 1, (HEIGHT, WIDTH, 3)).astype(np.float32)
    more = {} if kind is flat else {"dpi": dpi}
    whole = kind(color, height=HEIGHT, width=WIDTH, **more)
    for part in (Part(3, 5, 50, 40), Part(170, 100, 3, 1)):
        cut = kind(color, height=HEIGHT, width=WIDTH, part=part, **more)
        for name in ("rgb", "height", "grain"):
            assert np.array_equal(getattr(cut, name), getattr(whole, name)[part.rows, part.columns])


def painted(half: float, **options) -> Frame:
    """A stroke as wide as given, lengthwise along x."""
    boxes = relieved(boxes_of([[60, 50]], (58, half)))
    return rasterize(boxes, SOLID, width=120, height=100, streaks=0.2, relief=True, **options)


def test_wide_strokes_on_paper_have_bristles_of_their_own_size():
    dpi = 25.4 * 4 / BRISTLE_MM  # four pixels a bristle
    wide, plain = painted(48, dpi=dpi), painted(48)
    assert np.array_equal(wide.alpha, plain.alpha)
    added = (wide.height - plain.height)[10:90, 60]
    assert np.abs(added).max() > 0.1
    # Straight between the middles of two bristles: a bend every four pixels.
    is_bent = (np.abs(np.diff(added, 2)) > 1e-9).reshape(-1, 2)[:38].reshape(19, 4)
    assert sorted(is_bent.any(axis=0))[:2] == [False, False]
    assert is_bent.any(axis=1).mean() > 0.9
    assert not np.array_equal(wide.rgb, plain.rgb)


def test_layers_and_samples_are_cut_with_the_picture():
    rng, part = np.random.default_rng(1), Part(1, 2, 3, 2)
    counts = rng.integers(0, 4, 30)
    starts = np.concatenate([[0], np.cumsum(counts)])
    ids = np.repeat(np.arange(30), counts).astype(np.uint32)  # of each sample its pixel
    values = ids.astype(np.float32)
    deep = DeepSamples(starts, values[:, None].repeat(3, axis=1), values, values, ids, height=5, width=6)
    rows = np.arange(30, dtype=np.int32).reshape(5, 6, 1)
    layers = {"uv": rng.uniform(0, 1, (5, 6, 2)), "stroke": Matte(("a",), rows, rows.astype(np.float32))}
    frame = Frame(np.zeros((5, 6, 3)), np.ones((5, 6)), layers=layers, deep=deep)
    cut = frame.cut(part)
    pixels = np.arange(30).reshape(5, 6)[2:4, 1:4]
    assert np.array_equal(cut.layers["uv"], layers["uv"][2:4, 1:4])
    assert np.array_equal(cut.layers["stroke"].rows[..., 0], pixels)
    assert np.array_equal(cut.deep.ids, np.repeat(pixels.ravel(), counts[pixels.ravel()]))
    assert np.array_equal(np.diff(cut.deep.starts), counts[pixels.ravel()])
    assert (cut.deep.height, cut.deep.width) == cut.alpha.shape == (2, 3)
    with pytest.raises(ValueError, match="part must lie in the picture of 6x5"):
        frame.cut(replace(part, left=4))
