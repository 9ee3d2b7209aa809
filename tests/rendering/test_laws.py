"""Laws that every picture obeys, on scenes that hypothesis chooses."""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import brushgs as bg
from tests.rendering.paintings import assert_identical, filled
from tests.rendering.strokes import CAMERA, PATHS, random_boxes, scene_of, texture_of

SEEDS = st.integers(0, 2**32 - 1)
path_names = st.sampled_from(list(PATHS))


def painted(scene: bg.Gaussians, path: str, camera: bg.Camera = CAMERA) -> bg.Frame:
    kind, filter = PATHS[path]
    return bg.render(scene, camera, texture_of(kind), filter=filter)


def assert_close(actual: bg.Frame, expected: bg.Frame, tolerance: float, share: float = 0.0) -> None:
    """Equal to `tolerance` but for a share of the pixels, those on the other side of a hard edge."""
    for name in ("rgb", "alpha"):
        difference = np.abs(getattr(actual, name) - getattr(expected, name))
        assert np.mean(difference > tolerance) <= share, (name, difference.max())


@settings(max_examples=25, deadline=None)
@given(seed=SEEDS, path=path_names, dtype=st.sampled_from([np.float32, np.float64]))
def test_values_stay_in_range(seed, path, dtype):
    boxes = random_boxes(80, 70, 50, seed=seed, dtype=dtype)
    frame = filled(boxes, path, 70, 50)
    assert frame.alpha.min() >= 0
    assert frame.alpha.max() <= 1 - 0.9e-4  # a pixel is finished before less shines through
    assert frame.rgb.min() >= 0
    assert (frame.rgb <= frame.alpha[..., None] + 1e-6).all()  # colors here are at most 1
    seen = frame.alpha > 0
    assert not frame.depth[~seen].any()
    assert not frame.rgb[~seen].any()
    assert (frame.depth[seen] >= boxes.depths.min() * (1 - 1e-4)).all()
    assert (frame.depth[seen] <= boxes.depths.max() * (1 + 1e-4)).all()


@settings(max_examples=20, deadline=None)
@given(seed=SEEDS, path=path_names)
def test_neither_the_sign_of_quaternions_nor_the_order_of_rows_of_unequal_depths_matters(seed, path):
    scene = scene_of(seed)
    frame = painted(scene, path)
    shuffled = scene.take(np.random.default_rng(seed).permutation(len(scene)))
    for other in (replace(scene, quats=-scene.quats), shuffled):
        assert_identical(painted(other, path), frame)


@settings(max_examples=25, deadline=None)
@given(seed=SEEDS, path=path_names)
def test_moving_scene_and_camera_together_changes_nothing(seed, path):
    """Boxes move by some 1e-13 px, and so do edges: a share of 0.1 % may lie on the other side of one.

    `gaussian` ends in a step too, of exp(-4.5) = 0.011. Elsewhere 1e-13 px are at most 1e-11 of paint: the
    textures of noise change fully within a texel, and a needle's box of 1 px holds 40 of them.
    """
    g = np.random.default_rng(seed)
    turn, shift = Rotation.random(rng=g), g.normal(size=3) * 10
    scene = scene_of(seed)
    moved = replace(
        scene,
        means=turn.apply(np.array(scene.means)) + shift,
        quats=(turn * Rotation.from_quat(scene.quats[:, [1, 2, 3, 0]])).as_quat()[:, [3, 0, 1, 2]],
    )
    viewmat = np.eye(4)
    viewmat[:3, :3] = CAMERA.viewmat[:3, :3] @ turn.as_matrix().T
    viewmat[:3, 3] = CAMERA.viewmat[:3, 3] - viewmat[:3, :3] @ shift
    camera = replace(CAMERA, viewmat=viewmat)
    assert_close(painted(moved, path, camera), painted(scene, path), 1e-9, share=1e-3)


@settings(max_examples=20, deadline=None)
@given(seed=SEEDS, path=st.sampled_from(["bilinear", "nearest", "gaussian", "ellipse"]))
def test_tripling_the_picture_triples_every_length(seed, path):
    """By three, so that each third pixel center stays; the mip filter is meant to differ."""
    boxes = random_boxes(60, 50, 30, seed=seed, sizes=(2, 20))
    larger = replace(boxes, centers=boxes.centers * 3, half_extents=boxes.half_extents * 3)
    large = filled(larger, path, 150, 90)
    middles = bg.Frame(large.rgb[1::3, 1::3], large.alpha[1::3, 1::3])
    assert_close(middles, filled(boxes, path, 50, 30), 1e-10, share=1e-3)


@settings(max_examples=20, deadline=None)
@given(seed=SEEDS, path=path_names, turns=st.integers(-3, 3))
def test_half_a_turn_of_a_symmetric_stroke_and_whole_turns_of_any_change_nothing(seed, path, turns):
    boxes = random_boxes(60, 50, 30, seed=seed, sizes=(2, 20))
    step = np.pi if PATHS[path][0] != "image" else 2 * np.pi
    turned = replace(boxes, angles=boxes.angles + turns * step)
    frame, other = (filled(b, path, 50, 30) for b in (boxes, turned))
    assert_close(other, frame, 1e-11, share=1e-3)


@settings(max_examples=20, deadline=None)
@given(seed=SEEDS, path=path_names, dx=st.integers(-40, 40), dy=st.integers(-40, 40))
def test_a_crop_of_the_picture_is_the_picture_of_the_crop(seed, path, dx, dy):
    """Whole pixels of shift move strokes to other tiles and blocks; they must look the same there."""
    boxes = random_boxes(80, 60, 60, seed=seed, sizes=(0.5, 30))
    shifted = replace(boxes, centers=boxes.centers + np.array([dx, dy]))
    frame, other = (filled(b, path, 60, 60) for b in (boxes, shifted))
    y, x, v, u = max(dy, 0), max(dx, 0), max(-dy, 0), max(-dx, 0)
    h, w = 60 - abs(dy), 60 - abs(dx)
    overlap = bg.Frame(frame.rgb[v : v + h, u : u + w], frame.alpha[v : v + h, u : u + w])
    moved = bg.Frame(other.rgb[y : y + h, x : x + w], other.alpha[y : y + h, x : x + w])
    assert_close(moved, overlap, 1e-10, share=1e-3)
