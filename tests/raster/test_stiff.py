"""Stiff and extreme scenes: a finite picture comes out, and float32 shows what float64 shows."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.raster import reference
from brushgs.raster.ops import render
from brushgs.scene import Camera, Frame, Gaussians
from brushgs.textures import StrokeTexture
from tests.raster.strokes import PATHS, bristles

WIDTH, HEIGHT = 120, 90


def look(eye, target=(0, 0, 0), *, near=0.01) -> Camera:
    return Camera.look_at(eye, target, width=WIDTH, height=HEIGHT, near=near)


def scene_of(n: int, *, seed: int = 0, spread=0.6, sizes=(0.02, 0.3)) -> Gaussians:
    g = np.random.default_rng(seed)
    return Gaussians(
        g.normal(size=(n, 3)) * spread,
        g.normal(size=(n, 4)),
        np.exp(g.uniform(*np.log(sizes), (n, 3))),
        g.uniform(0.3, 1, n),
        g.normal(size=(n, 4, 3)) * 0.4,
    )


def resized(scene: Gaussians, unit: float) -> Gaussians:
    return replace(scene, means=scene.means * unit, scales=scene.scales * unit)


def pointing(scene: Gaussians, direction: str, aspect: float) -> Gaussians:
    """Needles of this aspect ratio that all lie along one axis of the world."""
    turn = {"across": (1, 0, 0, 0), "end-on": (1, 0, 1, 0)}[direction]  # x stays, or x becomes -z
    length = scene.scales[:, :1]
    scales = np.concatenate([length, length / aspect, length / aspect], axis=1)
    return replace(scene, quats=np.tile(np.array(turn, float), (len(scene), 1)), scales=scales)


FRONT = look((0.3, -0.4, -3))
BASE = scene_of(150)


def around_the_camera() -> Gaussians:
    means = BASE.means.copy()
    means[:3] = FRONT.position + np.array([[0, 0, 0.05], [0.01, 0, 0.2], [0, 0.02, 0.011]])
    scales = BASE.scales.copy()
    scales[:3] = 2.0
    return replace(BASE, means=means, scales=scales)


def far_surroundings() -> Gaussians:
    g = np.random.default_rng(3)
    means, scales = BASE.means.copy(), BASE.scales.copy()
    means[100:] = g.uniform(-2e7, 2e7, (50, 3))
    scales[100:] = np.exp(g.uniform(np.log(1e5), np.log(2e6), (50, 3)))
    return replace(BASE, means=means, scales=scales)


SCENES = {
    "needles across": (pointing(BASE, "across", 1e5), FRONT),
    "needles end-on": (pointing(BASE, "end-on", 1e5), look((0, 0, -3))),
    "needles through the near plane": (
        pointing(replace(BASE, scales=BASE.scales * 100), "end-on", 1e4),
        look((0, 0, -0.5)),
    ),
    "discs without thickness": (replace(BASE, scales=BASE.scales * (1, 1, 0)), FRONT),
    "points": (replace(BASE, scales=BASE.scales * 0), FRONT),
    "a Gaussian around the camera": (around_the_camera(), FRONT),
    "the camera inside the scene": (BASE, look((0.05, 0.02, 0.01), (1, 0.2, 0.3))),
    "a scene 1e-4 wide": (resized(BASE, 1e-4), look((3e-5, -4e-5, -3e-4), near=1e-6)),
    "a scene 1e4 wide": (resized(BASE, 1e4), look((3e3, -4e3, -3e4))),
    "extents of 2e7 around a subject": (far_surroundings(), FRONT),
    "a scene 1e5 from the origin": (
        replace(BASE, means=(BASE.means + 1e5).astype(np.float32).astype(np.float64)),
        look(1e5 + np.array((0.3, -0.4, -3)), (1e5, 1e5, 1e5)),
    ),
}


def painted(scene: Gaussians, camera: Camera, path: str, lock: str = "anchor") -> Frame:
    kind, filter = PATHS[path]
    texture = bristles() if kind == "image" else StrokeTexture.open(kind)
    return render(scene, camera, texture, filter=filter, lock=lock)


def assert_finite(frame: Frame) -> None:
    for plane in (frame.rgb, frame.alpha, frame.depth):
        assert np.isfinite(plane).all()
    assert frame.alpha.min() >= 0
    assert frame.alpha.max() < 1


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("path", PATHS)
def test_float32_shows_what_float64_shows(name, path):
    """Both are given the same float32 numbers. Boxes are made in float64 either way, and sampled in float32.

    Measured: up to 3 pixels of 10,800 on another texel (`nearest`). The others: worst mean difference 8e-6,
    from the rounding of texel coordinates in boxes of noise that fill the picture (`bilinear`); else 7e-7.
    """
    scene, camera = SCENES[name]
    single = scene.astype(np.float32)
    actual, expected = painted(single, camera, path), painted(single.astype(np.float64), camera, path)
    assert_finite(actual)
    assert_finite(expected)
    if name == "points" and PATHS[path][0] == "image":
        assert not expected.alpha.any()  # a stroke without length has faded; the kernels draw dots
    else:
        assert (expected.alpha > 0.2).mean() > 0.004
    off = np.abs(actual.rgb - expected.rgb).max(axis=2)
    assert off[off <= 1 / 255].mean() < 2e-5
    assert (off > 1 / 255).mean() <= 4e-4


@pytest.mark.parametrize("lock", ["anchor", "off"])
@pytest.mark.parametrize("name", SCENES)
def test_float64_is_the_definition(name, lock):
    scene, camera = SCENES[name]
    actual, size = painted(scene, camera, "mip", lock), {"width": WIDTH, "height": HEIGHT}
    boxes = reference.project(scene, camera, lock=lock, fade=True)
    expected = reference.rasterize(boxes, bristles(), **size)
    np.testing.assert_allclose(actual.rgb, expected.rgb, atol=1e-9)
    np.testing.assert_allclose(actual.alpha, expected.alpha, atol=1e-9)
