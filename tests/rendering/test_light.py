"""Light on the height of paint."""

from dataclasses import replace
from math import pi

import numpy as np

from brushgs.rendering import reference
from brushgs.rendering.light import Lamp, light
from brushgs.values.camera import Camera
from tests.kit.for_each import for_each

MATT = Lamp(strength=1.0, gloss=0.0)
SIZES = [(1, 1), (1, 9), (7, 1), (37, 53), (130, 201)]  # the last in several strips


def bumps(height: int, width: int, *, seed: int = 0, dtype=np.float64) -> np.ndarray:
    return np.random.default_rng([seed, height, width]).normal(0, 0.4, (height, width)).astype(dtype)


def colors(height: int, width: int, *, dtype=np.float64) -> np.ndarray:
    return np.random.default_rng([height, width]).uniform(0, 1, (height, width, 3)).astype(dtype)


# The definition


@for_each("lamp", [Lamp(), MATT, Lamp(0.3, 0.2, 0.7, 0.5, 7), Lamp(1, pi / 2, 0, 1, 1)])
@for_each("blur", [0.0, 0.6, 9.0])
@for_each("size", SIZES)
def test_kernel_agrees_with_the_definition(size, blur, lamp):
    rgb, height = colors(*size), bumps(*size)
    alpha = np.random.default_rng(1).uniform(0, 1, size)
    for of in (None, alpha):
        expected = reference.light(rgb, height, lamp, alpha=of, blur=blur)
        actual = light(rgb, height, lamp, alpha=of, blur=blur)
        np.testing.assert_allclose(actual, expected, rtol=1e-9, atol=1e-12)
        single_of = None if of is None else of.astype(np.float32)
        single = light(rgb.astype(np.float32), height.astype(np.float32), lamp, alpha=single_of, blur=blur)
        assert single.dtype == np.float32
        np.testing.assert_allclose(single, expected, atol=2e-5)


# What stays as it is


def test_what_is_not_painted_stays_empty():
    alpha = np.zeros((20, 30))
    alpha[5:15, 10:20] = 0.5
    rgb = 0.4 * np.repeat(alpha[..., None], 3, axis=2)
    lit = light(rgb, alpha * 3, Lamp(gloss=1), alpha=alpha)
    assert not lit[alpha == 0].any()
    assert (lit[5:15, 10:20] != rgb[5:15, 10:20]).any()


def test_a_picture_twice_as_large_is_lit_alike():
    """Heights and the blur are lengths on the canvas."""
    means = []
    for scale in (1, 2):
        y, x = (np.mgrid[: 300 * scale, : 400 * scale] + 0.5) / scale
        height = scale * 2 * np.sin(2 * pi * (x + 0.4 * y) / 30)
        grey = np.full((*height.shape, 3), 0.5)
        lit, sharp = (light(grey, height, Lamp(gloss=0), blur=blur)[..., 0] for blur in (10.0, 0.0))
        middle = np.s_[15 * scale : -15 * scale, 15 * scale : -15 * scale]
        means.append(np.abs(lit - 0.5)[middle].mean())
        assert means[-1] < 0.8 * np.abs(sharp - 0.5)[middle].mean()
    np.testing.assert_allclose(means[1], means[0], rtol=0.03)


# A lamp in the scene


def seen_from(azimuth: float, elevation: float = 0.2) -> Camera:
    eye = 3 * np.array([np.sin(azimuth) * np.cos(elevation), -np.sin(elevation), -np.cos(azimuth)])
    return Camera.look_at(eye, (0, 0, 0), up=(0, -1, 0), width=40, height=30)


def towards(lamp: Lamp, camera: Camera) -> tuple[float, float, float]:
    x, y, z = lamp.direction @ np.diag([1.0, 1.0, -1.0]) @ camera.viewmat[:3, :3]
    return float(x), float(y), float(z)


def test_a_lamp_in_the_scene_stands_where_a_view_says():
    """In the view in which its angles were given it shines as one of the canvas does."""
    camera, lamp = seen_from(0.7), Lamp(4.0, 1.1)
    seen = replace(Lamp(), towards=towards(lamp, camera)).seen_by(camera)
    np.testing.assert_allclose(seen.direction, lamp.direction, atol=1e-12)


def test_a_lamp_right_before_or_behind_the_canvas_casts_no_shade():
    camera = seen_from(0.3)
    for ahead in (-1.0, 1.0):
        x, y, z = (ahead * camera.viewmat[2, :3]).tolist()
        np.testing.assert_allclose(Lamp(towards=(x, y, z)).seen_by(camera).direction, (0, 0, 1), atol=1e-9)
