"""Tones of pictures of strokes, and spot blacks: few, large, smooth, and on both sides of a jump of depth."""

import numpy as np
from scipy import ndimage

from brushgs.rendering.nested import scale_of
from brushgs.rendering.tonal import Blacks, Tones, blacks_of, large_ones
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame

INK, PAPER = (0.1, 0.1, 0.12), (0.96, 0.95, 0.9)


def camera(width=320, height=180):
    return Camera.look_at((0, 0, -4), (0, 0, 0), width=width, height=height)


def picture(tone, alpha=1.0, depth=1.0):
    """A picture of strokes in greys, [H, W] each."""
    tone = np.asarray(tone, np.float32)
    alpha = np.broadcast_to(np.float32(alpha), tone.shape).copy()
    rgb = np.repeat((tone * alpha)[..., None], 3, axis=2)
    return Frame(rgb, alpha, np.broadcast_to(np.float32(depth), tone.shape).copy())


def disc(height=180, width=320, radius=30, x=160, y=90):
    rows, columns = np.mgrid[0:height, 0:width] + 0.5
    return np.hypot(columns - x, rows - y) < radius


def tones_of(frame, view):
    return Tones.of(frame.rgb, frame.alpha, frame.depth, scale_of(view))


def test_a_dark_mass_becomes_ink_and_the_rest_paper():
    frame = picture(np.where(disc(), 0.1, 0.8))
    laid = Blacks(0.3, 1e-3, INK, PAPER)(frame, camera())
    np.testing.assert_allclose(laid.rgb[90, 160], INK, atol=1e-6)
    np.testing.assert_allclose(laid.rgb[10, 10], PAPER, atol=1e-6)
    assert (laid.alpha == 1).all()
    is_black = laid.rgb[..., 1] < 0.5
    assert abs(is_black.sum() / disc().sum() - 1) < 0.05
    assert frame.rgb[90, 160, 0] == np.float32(0.1), "its input is not changed"


def test_small_spots_and_small_holes_are_left_out():
    mask = disc(radius=40) & ~disc(radius=4) | disc(radius=5, x=30, y=30)
    kept = large_ones(mask, 200 / mask.size)
    assert not kept[30, 30]
    assert kept[90, 160]
    np.testing.assert_array_equal(kept, disc(radius=40))


def test_a_region_whose_neck_is_smoothed_away_leaves_no_spot():
    """Of two discs on a neck of one pixel, one smaller than the least area, that one goes with the neck."""
    view = camera(960, 540)
    mask = disc(540, 960, 60, 300, 270) | disc(540, 960, 5.5, 400, 270)
    mask[270, 300:400] = True

    class Masked(Tones):
        def is_black(self, threshold):
            return mask

    flat = np.ones(mask.shape, np.float32)
    tones = Masked(flat, flat, flat, np.zeros(mask.shape, bool), scale_of(view))
    shares = Blacks(0.3, 140 / mask.size, INK, PAPER).shares(tones)
    assert ndimage.label(shares > 0)[1] == 1
    assert shares[270, 300] == 1
    assert shares[270, 400] == 0


def test_there_are_no_more_regions_than_allowed():
    tone = np.full((180, 320), 0.8)
    for k in range(40):
        tone[disc(radius=5 + k / 20, x=20 + 40 * (k % 8), y=20 + 35 * (k // 8))] = 0.1
    tones = tones_of(picture(tone), camera())
    threshold, least = blacks_of([tones], share=0.17, most_regions=25, least_pixels=10.0)
    assert 0 < ndimage.label(large_ones(tones.is_black(threshold), least))[1] <= 25


def test_edges_of_films_are_soft_in_tone_and_stay_in_place():
    slope = np.tile(np.linspace(0, 0.6, 320), (180, 1))
    view = camera()
    layers = (Blacks(0.3, 1e-3, INK, PAPER, softness) for softness in (0, 0.06))
    sharp, soft = (blacks(picture(slope), view).rgb[90, :, 1] for blacks in layers)
    assert np.abs(np.diff(soft)).max() < 0.5 * np.abs(np.diff(sharp)).max()
    assert abs(np.argmax(sharp > 0.5) - np.argmax(soft > 0.5)) <= 3
    assert np.abs(soft - sharp).mean() < 0.1
