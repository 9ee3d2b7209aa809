"""Pictures of one pixel and of 67 million, textures of any kind, and more strokes than tile lists hold."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.rendering import reference
from brushgs.rendering.rasterize import RasterOptions, rasterize
from brushgs.rendering.underpaint import Underpaint
from tests.kit.for_each import for_each
from tests.rendering.strokes import PATHS, boxes_of, bristles, random_boxes, softened, texture_of
from tests.stiff.test_pictures import assert_finite


@for_each("path", PATHS)
@for_each("dtype", [np.float32, np.float64])
def test_a_picture_of_one_pixel_is_as_defined(path, dtype):
    kind, filter = PATHS[path]
    boxes = random_boxes(40, 1, 1, sizes=(0.2, 4), dtype=dtype)
    for some in (boxes, softened(boxes, 3.0)):
        how = {"height": 1, "width": 1, "filter": filter}
        actual = rasterize(some, texture_of(kind), **how)
        expected = reference.rasterize(some, texture_of(kind), RasterOptions(**how))
        np.testing.assert_allclose(actual.rgb, expected.rgb, atol=1e-5 if dtype == np.float32 else 1e-9)


@pytest.mark.parametrize("order", ["depth", "soft"])
def test_a_picture_of_8192_by_8192_has_its_strokes_where_they_belong(order):
    """Corners and middle of 67 million pixels, as in windows of their own. Without depth: 1 GB of planes."""
    side = 8192
    centers = np.array([(5, 5), (8187, 5), (5, 8187), (8187, 8187), (4096.5, 4096.5), (4096.5, 4096.5)])
    angles = [0.3, 0.3, 0.3, 0.3, 0.3, np.pi / 4]
    boxes = boxes_of(centers, [(40, 20)] * 5 + [(9000, 1)], angles=angles, dtype=np.float32)
    if order == "soft":
        boxes = replace(boxes, softness=np.full(6, 2, np.float32))
    frame = rasterize(boxes, bristles(), height=side, width=side, depth=False)
    assert frame.rgb.shape == (side, side, 3)
    for x, y in ((0, 0), (side - 64, 0), (0, side - 64), (side - 64, side - 64), (4064, 4064)):
        window = replace(boxes, centers=boxes.centers - np.float32((x, y)))
        alone = rasterize(window, bristles(), height=64, width=64)
        part = frame.rgb[y : y + 64, x : x + 64]
        assert part.any()
        # 8192 pixels away float32 centers lie 5e-4 off.
        np.testing.assert_allclose(part, alone.rgb, atol=2e-3)
    middle = frame.alpha[1000:1100, 1000:1100]
    assert 0 < np.count_nonzero(middle) < 600  # the long stroke passes here, two pixels wide


def test_strips_of_a_picture_are_the_picture():
    """20,000 strokes over 4096 tiles are painted in two strips; over the left 256 tiles alone in one. Bit
    for bit.
    """
    boxes = random_boxes(20_000, 2048, 64, sizes=(4e4, 5e4), dtype=np.float32)
    boxes = replace(boxes, centers=np.clip(boxes.centers, 0, (2048, 64)).astype(np.float32))
    for some in (boxes, softened(boxes, 1e-3)):
        wide, left = (
            rasterize(some, texture_of("image"), height=64, width=width) for width in (32_767, 2048)
        )
        np.testing.assert_array_equal(wide.rgb[:, :2048], left.rgb)
        np.testing.assert_array_equal(wide.depth[:, :2048], left.depth)
        assert wide.alpha.min() > 0.9


@for_each("dtype", [np.float32, np.float64])
@for_each("path", PATHS)
def test_boxes_of_any_finite_numbers_are_painted_finite(path, dtype):
    """Places, extents, angles, depths, colors, softness and setbacks from the smallest to the largest
    float32, at random.
    """
    kind, filter = PATHS[path]
    g, texture = np.random.default_rng(0), texture_of(kind)
    sizes = (0, 1e-45, 1e-30, 1e-12, 1e-6, 1e-3, 0.5, 3, 20, 200, 1e4, 1e7, 1e12, 1e20, 1e30, 3e38)
    for _ in range(60):
        n = int(g.integers(1, 12))
        far = g.choice((-1, 1), (n, 2)) * g.choice((0, 0.5, 25.5, 35, 1e3, 1e5, 1e7, 1e20, 3e38), (n, 2))
        boxes = boxes_of(
            np.where(g.random((n, 1)) < 0.6, g.uniform(0, 60, (n, 2)), far),
            g.choice(sizes, (n, 2)),
            angles=g.choice((0, np.pi / 2, np.pi, 1e-30, 1, -2, 1e4, 1e10, 1e30, -3e38), n),
            depths=np.sort(g.choice((1e-45, 1e-30, 1e-3, 1, 1e3, 1e30, 3e38), n)),
            colors=g.choice((0, 1e-45, 0.5, 1, 1e10, 1e38), (n, 3)),
            opacities=g.choice((0, 1e-45, 1 / 255, 0.5, 0.99, 1), n),
            dtype=dtype,
        )
        for softness in (None, g.choice((0, 1e-45, 1e-20, 1e-3, 1, 1e3, 1e20, 3e38), n).astype(dtype)):
            soft, how = replace(boxes, softness=softness), {"height": 50, "width": 70, "filter": filter}
            assert_finite(rasterize(soft, texture, **how))
            setbacks = g.choice((0, 1e-45, 1e-20, 1, 1e20, 3e38), n).astype(dtype)
            look = {"underpaint": Underpaint(float(g.choice((1e-20, 0.5, 2, 1e20)))), "streaks": 0.5}
            assert_finite(rasterize(replace(soft, setbacks=setbacks), texture, **how, **look))
