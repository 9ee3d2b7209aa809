"""The wet layer of watercolour, and noise anchored in space."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from brushgs.core.threads import at_most
from brushgs.pipeline.media.looking import looked_at
from brushgs.rendering import wet_layer
from brushgs.rendering.space_noise import FINEST, OCTAVES, Anchor, space_noise
from brushgs.rendering.surface import paper
from brushgs.rendering.wet_layer import ROUNDS, Key, ShadowWash, Washes, WetLayer, ragged_border, smooth
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from tests.kit.for_each import for_each
from tests.rendering import wet_reference as reference

SIZES = [(1, 1), (1, 9), (7, 1), (37, 53), (70, 131)]  # the last in several strips and runs
ANCHOR = Anchor((0.3, -0.2, 4.0), 4.0, (0.1, 0.2, 3.5), 1.5, seed=3)
KEY = Key(0.1, 0.8)
TOLERANCES = {np.float64: {"rtol": 1e-9, "atol": 1e-9}, np.float32: {"rtol": 0, "atol": 1e-4}}


def camera_of(height: int, width: int, *, scale: float = 1.0, angle: float = 0.0) -> Camera:
    """Looks at a point 4 in front of the origin, from a direction."""
    cos, sin = np.cos(angle), np.sin(angle)
    view = np.eye(4)
    view[:3, :3] = [[cos, 0, -sin], [0, 1, 0], [sin, 0, cos]]
    view[:3, 3] = [0, 0, 4 * scale] - view[:3, :3] @ [0, 0, 4 * scale]
    focal = 1.2 * max(height, width)
    return Camera(view, np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]]), width, height)


def random(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng([seed, *shape]).random(shape)


def depths(height: int, width: int) -> np.ndarray:
    """Depths with holes and jumps."""
    depth = 1.5 + 6 * random(height, width, seed=1) ** 3
    return np.where(random(height, width, seed=2) < 0.2, 0.0, depth)


def painted(height: int, width: int, dtype=np.float32) -> Frame:
    """A disc of two colors before nothing."""
    y, x = np.mgrid[:height, :width] / max(height, width) * 2 - 1
    alpha = np.clip((0.8 - np.hypot(x + 0.1, y + 0.3)) * 8, 0, 1)
    halves = np.where((x < -0.1)[..., None], [0.5, 0.2, 0.1], [0.15, 0.25, 0.5])
    colors = halves * (0.6 + 0.4 * np.sin(7 * y))[..., None]
    depth = np.where(alpha > 0, 4 - 0.5 * x, 0)
    return Frame((colors * alpha[..., None]).astype(dtype), alpha.astype(dtype), depth.astype(dtype))


@for_each("dtype", [np.float64, np.float32])
@for_each("size", SIZES)
def test_kernels_agree_with_the_definitions(size, dtype):
    depth, guide = depths(*size).astype(dtype), random(*size, 3).astype(dtype)
    camera, hold, near = camera_of(*size), (9 * random(*size, seed=4)).astype(dtype), TOLERANCES[dtype]

    noise = space_noise(depth, camera, ANCHOR)
    wanted = reference.space_noise(depth, camera, ANCHOR, finest=FINEST, octaves=OCTAVES)
    assert noise.dtype == dtype
    np.testing.assert_allclose(noise, wanted, rtol=near["rtol"], atol=max(near["atol"], 1e-7))

    for planes, edges in ((random(*size, 1), (None, None)), (random(*size, 3), (guide, hold))):
        got = smooth(planes.astype(dtype), 5.0, guide=edges[0], hold=edges[1])
        np.testing.assert_allclose(got, reference.smooth(planes, 5.0, *edges, ROUNDS), **near)

    alpha = np.where(depth > 0, random(*size, seed=5), 0).astype(dtype)
    rgb = guide * alpha[..., None]
    np.testing.assert_allclose(KEY.colors(rgb, alpha), reference.key_colors(rgb, alpha, KEY), **near)

    smoothed, washes = [random(*size, 3, seed=k).astype(dtype) for k in (6, 7, 8)], Washes()
    noise[..., 2] = np.minimum(noise[..., 2], 1)
    parted = wet_layer._parted(smoothed, noise, washes)
    for one, other in zip(parted, reference.part_washes(smoothed, noise, washes), strict=True):
        np.testing.assert_allclose(one, other, **near)

    blurred = parted[1] * dtype(0.7)
    lost = np.stack([alpha**2, 2 * alpha - 1], axis=-1), (depth / 8, alpha, guide)
    for soft, sheet in ((None, (None, None, None)), lost):
        got = wet_layer._mixed(parted, blurred, noise, (alpha, soft), sheet, washes)
        wanted = reference.mix_washes(parted, blurred, noise, (alpha, soft), sheet, washes)
        for one, other in zip(got, wanted, strict=True):
            np.testing.assert_allclose(one, other, **near)


@for_each("scale", [1e-12, 1.0, 1e12])
def test_the_unit_of_a_scene_changes_nothing(scale):
    size = 60, 80
    frame, camera = painted(*size), camera_of(*size, scale=scale)
    camera = replace(camera, near=0.01 * scale)
    x, y, z = (scale * np.array(ANCHOR.center)).tolist()
    a, b, c = (scale * np.array(ANCHOR.focus)).tolist()
    anchor = Anchor((x, y, z), scale * ANCHOR.scale, (a, b, c), scale * ANCHOR.reach, seed=3)
    scaled = replace(frame, depth=(frame.depth * scale).astype(np.float32))
    expected = WetLayer(KEY, ANCHOR)(frame, camera_of(*size), None)
    actual = WetLayer(KEY, anchor)(scaled, camera, None)
    np.testing.assert_allclose(actual.rgb, expected.rgb, atol=2e-3)


def test_threads_and_pickles_give_the_same_bits():
    size = 150, 210
    camera, sheet = camera_of(*size), paper((0.98, 0.98, 0.95), height=size[0], width=size[1])
    for is_room in (False, True):
        layer = WetLayer(KEY, ANCHOR, is_room)
        frames = []
        for num_threads in (1, 3):
            with at_most(num_threads):
                frames.append(pickle.loads(pickle.dumps(layer))(painted(*size), camera, sheet))
        assert np.array_equal(frames[0].rgb, frames[1].rgb)
        assert np.array_equal(frames[0].alpha, frames[1].alpha)


@for_each("size", SIZES)
def test_nothing_stays_nothing_and_inputs_do_not_change(size):
    empty = Frame(np.zeros((*size, 3), np.float32), np.zeros(size, np.float32), np.zeros(size, np.float32))
    for is_room in (False, True):
        layer = WetLayer(KEY, ANCHOR, is_room)
        laid = layer(empty, camera_of(*size), None)
        assert not laid.alpha.any()
        assert not laid.rgb.any()
        frame = painted(*size)
        before = [plane.copy() for plane in (frame.rgb, frame.alpha, frame.depth)]
        laid = layer(frame, camera_of(*size), None)
        for plane, copy in zip((frame.rgb, frame.alpha, frame.depth), before, strict=True):
            assert np.array_equal(plane, copy)
        assert np.isfinite(laid.rgb).all()
        assert (laid.rgb >= 0).all()
        assert (laid.rgb <= laid.alpha[..., None] + 1e-6).all()


def test_a_room_ends_in_a_ragged_border_of_paper():
    border = ragged_border(180, 240, "float32")
    assert not border[[0, -1]].any()
    assert not border[:, [0, -1]].any()
    assert border[60:120, 60:180].min() == 1
    first = np.argmax(border[:, 40:200] > 0.5, axis=0)
    assert first.std() > 1  # ragged
    with pytest.raises(ValueError, match="read-only"):
        border[0] = 1


Y, X = np.mgrid[:240, :480]


def disc(x: float, y: float, radius: float) -> np.ndarray:
    return np.hypot(X - x, Y - y) < radius


def shown(mask: np.ndarray, light) -> Frame:
    """What is painted 4 in front of the camera, in a tone or tones."""
    alpha = mask.astype(np.float64)
    return Frame((light * alpha)[..., None] * (1.0, 0.98, 0.96), alpha, 4 * alpha)


def test_a_share_of_a_lost_outline_is_lost_where_all_of_it_would_be():
    """A light disc; density, of which some stays, falls evenly with the share."""
    frame, camera = shown(disc(90, 60, 50)[:120, :240], 0.6), camera_of(120, 240)
    layer, (wet,) = looked_at(WetLayer(KEY, ANCHOR), [(frame, camera)])
    layers = [replace(layer, losing=share) for share in (0, 0.5, 1)]
    lost = [one.lost(wet) for one in layers]
    assert not lost[0].any()
    assert lost[2].max() > 0.9
    assert abs(lost[1].max() - 0.5 * lost[2].max()) < 0.05
    means = [one(frame, camera, None).over(np.ones(3)).mean() for one in layers]
    assert means[0] < means[1] < means[2]


def test_washes_reach_the_edge_of_a_sheet_without_border():
    frame, camera = shown(np.ones((60, 80)), 0.5), camera_of(60, 80)
    for is_room in (False, True):
        layers = [WetLayer(KEY, ANCHOR, is_room, has_border=one) for one in (False, True)]
        whole, bare = (layer(frame, camera, None).over(np.ones(3)) for layer in layers)
        assert bare[0].min() > 0.95
        assert whole[0].max() < 0.9
    tints = [ShadowWash(ANCHOR, has_border=one)(frame, camera, None).rgb[0] for one in (True, False)]
    assert tints[0].min() > 0.95
    assert tints[1].max() < 0.9


def test_darks_of_a_small_subject_get_dark_by_rank():
    """The darkest 2 % of the picture are a third of a disc of middle tones; a dark disc stays as it is."""
    anchor, tones = Anchor((0, 0, 4), 4.0, (0, -50, 4), 1.0, seed=3), {}
    for radius, darkest in ((48, 0.4), (110, 0.05)):
        frame = shown(disc(200, 120, radius), np.where(200 - radius / 4 > X, darkest, 0.75))
        tones[radius], _ = looked_at(WetLayer(Key(0.05, 0.95), anchor), [(frame, camera_of(240, 480))])
    assert tones[110].key == Key(0.05, 0.95)
    assert tones[48].key.gamma > 1.2 * tones[110].key.gamma
    assert tones[48].key.chroma < 0.95 * tones[110].key.chroma, "or what gets darker gets more colorful"


def test_the_night_behind_a_window_is_no_bare_paper_but_what_no_paint_surrounds_is():
    """A dark wall with a hole of 8 x 8 pixels in it, whose right third is not painted at all."""
    size = 120, 240
    alpha = np.ones(size, np.float32)
    alpha[56:64, 76:84] = alpha[:, 160:] = 0
    frame = Frame(0.1 * alpha[..., None].repeat(3, axis=2), alpha, np.full(size, 4, np.float32))
    laid = WetLayer(KEY, ANCHOR, is_room=True)(frame, camera_of(*size), None).over((1, 1, 1))
    assert laid[56:64, 76:84].max() < 0.5
    assert laid[40:80, 200:].min() > 0.95
