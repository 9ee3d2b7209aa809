"""Pictures of one pixel and of 67 million, textures of any kind, and more strokes than tile lists hold."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from brushgs.brushes.texture import StrokeTexture
from brushgs.errors import SceneError
from brushgs.rendering import reference
from brushgs.rendering.project import Directions, project
from brushgs.rendering.rasterize import rasterize
from brushgs.rendering.underpaint import Underpaint
from tests.brushes.test_texture import PALETTE_PNG, blob, rgba, write_image
from tests.kit.for_each import for_each
from tests.rendering.strokes import PATHS, boxes_of, bristles, random_boxes, softened, texture_of
from tests.stiff.scenes import EYE, orbit, random_scene
from tests.stiff.test_pictures import assert_finite


@for_each("path", PATHS)
@for_each("dtype", [np.float32, np.float64])
def test_a_picture_of_one_pixel_is_as_defined(path, dtype):
    kind, filter = PATHS[path]
    boxes = random_boxes(40, 1, 1, sizes=(0.2, 4), dtype=dtype)
    for some in (boxes, softened(boxes, 3.0)):
        actual = rasterize(some, texture_of(kind), height=1, width=1, filter=filter)
        expected = reference.rasterize(some, texture_of(kind), height=1, width=1, filter=filter)
        np.testing.assert_allclose(actual.rgb, expected.rgb, atol=1e-5 if dtype == np.float32 else 1e-9)


@pytest.mark.parametrize("order", ["depth", "soft"])
def test_a_picture_of_8192_by_8192_has_its_strokes_where_they_belong(order):
    """Corners and middle of 67 million pixels, as in windows of their own. Without depth: 1 GB of planes."""
    side = 8192
    centers = np.array([(5, 5), (8187, 5), (5, 8187), (8187, 8187), (4096.5, 4096.5), (4096.5, 4096.5)])
    boxes = boxes_of(
        centers, [(40, 20)] * 5 + [(9000, 1)], angles=[0.3, 0.3, 0.3, 0.3, 0.3, np.pi / 4], dtype=np.float32
    )
    if order == "soft":
        boxes = replace(boxes, softness=np.full(6, 2, np.float32))
    frame = rasterize(boxes, bristles(), height=side, width=side, depth=False)
    assert frame.rgb.shape == (side, side, 3)
    for x, y in ((0, 0), (side - 64, 0), (0, side - 64), (side - 64, side - 64), (4064, 4064)):
        window = replace(boxes, centers=boxes.centers - np.float32((x, y)))
        alone = rasterize(window, bristles(), height=64, width=64)
        part = frame.rgb[y : y + 64, x : x + 64]
        assert part.any()
        # 8192 pixels away float32 centres lie 5e-4 off.
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
    """Places, extents, angles, depths, colours, softness and setbacks from the smallest to the largest
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
            assert_finite(
                rasterize(replace(boxes, softness=softness), texture, height=50, width=70, filter=filter)
            )
            setbacks = g.choice((0, 1e-45, 1e-20, 1, 1e20, 3e38), n).astype(dtype)
            look = {"underpaint": Underpaint(float(g.choice((1e-20, 0.5, 2, 1e20)))), "streaks": 0.5}
            layered = replace(boxes, softness=softness, setbacks=setbacks)
            assert_finite(rasterize(layered, texture, height=50, width=70, filter=filter, **look))


@for_each("angle", [1e6, -3e9, 1e20, 3e38])
def test_angles_of_any_size_are_turned_all_the_way(angle):
    boxes = boxes_of([(20, 15)], (12, 3), angles=angle)
    actual = rasterize(boxes, bristles(), height=30, width=40)
    expected = reference.rasterize(boxes, bristles(), height=30, width=40)
    np.testing.assert_allclose(actual.rgb, expected.rgb, atol=1e-9)
    scene, camera = random_scene(), orbit(EYE)[0]
    asked = Directions(np.full(60, angle, np.float32))
    near = Directions(
        np.arctan2(np.sin(np.float64(asked.angles)), np.cos(np.float64(asked.angles))).astype(np.float32)
    )
    one, two = (project(scene, camera, lock=lock) for lock in (asked, near))
    np.testing.assert_allclose(one.half_extents, two.half_extents, rtol=1e-6)


FULL = {np.uint8: 255, np.uint16: 65535}


@pytest.mark.parametrize("kind", ["one texel", "16 bit", "grey", "grey with alpha", "palette"])
def test_textures_of_every_kind_paint(tmp_path: Path, kind):
    path = tmp_path / "a.png"
    if kind == "palette":
        path.write_bytes(PALETTE_PNG)
    else:
        pixels = {
            "one texel": rgba(np.full((1, 1), 0.4)),
            "16 bit": np.rint(rgba(blob(20, 40)) * FULL[np.uint16]).astype(np.uint16),
            "grey": 1 - 0.9 * blob(20, 40)[..., None],
            "grey with alpha": np.stack([np.full((20, 40), 0.7), blob(20, 40)], axis=2),
        }[kind]
        write_image(path, pixels)
    texture = StrokeTexture.open(path)
    boxes = random_boxes(30, 40, 30, sizes=(0.3, 20))
    for filter in ("mip", "bilinear", "nearest"):
        for some in (boxes, softened(boxes, 3.0)):
            actual = rasterize(some, texture, height=30, width=40, filter=filter)
            expected = reference.rasterize(some, texture, height=30, width=40, filter=filter)
            np.testing.assert_allclose(actual.rgb, expected.rgb, atol=1e-9)
            assert actual.alpha.max() > 0.1


def test_a_texture_without_paint_is_refused_by_name_or_paints_nothing(tmp_path: Path):
    with pytest.raises(SceneError, match="the stroke is fully transparent"):
        StrokeTexture.open(write_image(tmp_path / "a.png", rgba(np.zeros((8, 8)))))
    texture = StrokeTexture.from_coverage(np.zeros((8, 8)))
    assert not rasterize(random_boxes(30, 40, 30), texture, height=30, width=40).alpha.any()
