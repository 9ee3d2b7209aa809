"""Rubbing gathers tone in values, blurs their edges by places in space, and depends on one frame alone."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.rendering.rub import Rub

PAPER, BLACK = (0.8, 0.77, 0.7), (0.09, 0.09, 0.08)
VALUES = (0.0, 0.2, 0.5, 0.75)
CAMERA = bg.Camera.look_at((0, 0, -4), (0, 0, 0), (0, -1, 0), width=320, height=240)
RUB = Rub(PAPER, BLACK, VALUES, 1.0, 1.5)


def frame_of(shares, alpha=None):
    alpha = np.ones(shares.shape, np.float32) if alpha is None else alpha
    colors = np.asarray(PAPER) + shares[..., None] * (np.asarray(BLACK) - np.asarray(PAPER))
    return bg.Frame(
        (colors * alpha[..., None]).astype(np.float32), alpha, np.full(shares.shape, 4, np.float32)
    )


def shares_of(frame):
    way = np.asarray(BLACK) - np.asarray(PAPER)
    return (frame.rgb / frame.alpha[..., None] - np.asarray(PAPER)) @ way / (way @ way)


def test_edges_are_rubbed_more_here_than_there_and_not_at_strength_0():
    step = np.where(np.arange(320) < 160, 0.0, 0.75) * np.ones((240, 1))
    rubbed = shares_of(RUB(frame_of(step), CAMERA, None))
    sharp = shares_of(replace(RUB, strength=0.0)(frame_of(step), CAMERA, None))
    steepest = np.abs(np.diff(rubbed, axis=1)).max(axis=1)
    assert steepest.max() > 1.3 * steepest.min()
    assert np.abs(np.diff(sharp, axis=1)).max(axis=1).min() >= steepest.max() - 1e-6


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_coverage_never_grows_and_what_comes_in_stays(dtype):
    alpha = np.random.default_rng(0).random((240, 320)).astype(dtype)
    frame = frame_of(np.full((240, 320), 0.5), alpha)
    frame = bg.Frame(frame.rgb.astype(dtype), alpha, frame.depth.astype(dtype))
    before = frame.rgb.copy()
    found = RUB(frame, CAMERA, None)
    assert found.rgb.dtype == found.alpha.dtype == dtype
    assert (found.alpha <= alpha).all()
    assert np.isfinite(found.rgb).all()
    np.testing.assert_array_equal(frame.rgb, before)


def test_nothing_stays_nothing_and_a_rub_can_be_pickled():
    nothing = bg.Frame(*(np.zeros((240, 320, *more), np.float32) for more in ((3,), (), ())))
    found = pickle.loads(pickle.dumps(RUB))(nothing, CAMERA, None)
    assert not found.rgb.any()
    assert not found.alpha.any()
    tiny = replace(CAMERA, width=1, height=1)
    assert RUB(frame_of(np.zeros((1, 1))), tiny, None).alpha.shape == (1, 1)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_small_holes_of_a_room_take_the_tone_around_them_and_lie_far_away(dtype):
    alpha = np.ones((240, 320), dtype)
    alpha[100:108, 50:58] = 0  # a pane
    alpha[:, 200:] = 0.02  # the sky
    alpha[20:30, 20:30] = 0.1  # glass: of its own tone
    tone = np.full((240, 320), 0.5)
    tone[20:30, 20:30] = 0.75
    frame = frame_of(tone, alpha)
    depth = np.where(alpha > 0, frame.depth, 0).astype(dtype)
    depth[:, 150:200] = 7
    frame = bg.Frame(frame.rgb.astype(dtype), alpha, depth)
    rubs = (replace(RUB, strength=0.0, is_room=is_room) for is_room in (False, True))
    object_, room = (rub(frame, CAMERA, None) for rub in rubs)
    assert object_.alpha[104, 54] < 0.05
    assert room.alpha[104, 54] > 0.95
    toned = shares_of(bg.Frame(room.rgb[:, :150], room.alpha[:, :150], None))
    np.testing.assert_allclose(toned[104, 54], toned[150, 100], atol=0.02)
    assert toned[25, 25] > toned[150, 100] + 0.1
    assert room.alpha[120, 300] < 0.3, "what no paint surrounds stays bare"
    assert room.depth[104, 54] == 7
    assert room.rgb.dtype == room.alpha.dtype == room.depth.dtype == dtype
    assert replace(RUB, is_room=True).reach(CAMERA) is None
