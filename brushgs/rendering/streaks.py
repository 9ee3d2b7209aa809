"""Streaks: lighter and darker lines of bristles along a stroke.

A stroke's color is multiplied by 1 + streaks x s, with s in -1 to 1 a fixed noise across the stroke. The
offset into the noise is a hash of the Gaussian's row, so a stroke keeps its streaks in all views. The noise
has two bands: single bristles, and tufts of several. Each fades out as a stroke gets smaller, before pixels
cannot resolve it, so that nothing shimmers.

On paper of a known resolution, wide strokes have additional bristles of a physical width, `BRISTLE_MM`, in
color and height of paint: the stroke image is limited by its texels, and would look blurred from nearby.
"""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.brush_set import BrushSet
from brushgs.core.native import core as _core
from brushgs.values.arrays import F64, Array, smoothstep
from brushgs.values.boxes import Boxes

MOST_STREAKS = 0.5
PERIOD = 256  # bristles per period of the noise; also the number of offsets
TUFT = 8  # bristles per tuft: width of the smoothing window
# Pixels per bristle at which its band starts to show, and shows in full: waves of 2 and 4 pixels.
BRISTLE_FADE = (1.0, 2.0)
TUFT_FADE = (0.25, 0.5)
BRISTLES: int = _core.BRISTLES  # 12 across a box
BRISTLE_MM = 0.3  # of hog hair with paint on it
# Stroke width over that of twelve physical bristles at which these start to show, and show in full.
FINE_FROM = (1.2, 2.4)
FINE_STREAKS = 0.6  # of the amplitude of streaks
FINE_GAIN = 0.07  # mm, deviation of the paint's height for noise of 1
MOST_FINE = 2048.0  # bristles across a box, from the core
# Bristles on either side of the box: filtered levels are larger than it.
MARGIN: int = _core.BRISTLE_MARGIN


def streak_arguments(
    boxes: Boxes, streaks: float, brush_set: BrushSet, *, dpi: float | None = None, relief: bool = False
) -> dict[str, Any]:
    """Core arguments for streaks; empty if they are 0. With a `dpi` also bristles of a physical width."""
    if streaks == 0:
        return {}
    is_smooth = brush_set.without_bristles(boxes.brushes)
    weights = streak_weights(boxes, streaks, is_smooth)
    found = {"streak_noise": packed_noise(), "streak_starts": streak_starts(boxes), "streak_weights": weights}
    if dpi is not None:
        found["streak_fine"] = fine_bristles(boxes, streaks, dpi, is_smooth, relief=relief)
    return found


def fine_bristles(
    boxes: Boxes, streaks: float, dpi: float, is_smooth: NDArray[np.bool_] | None = None, *, relief: bool
) -> Array:
    """[M, 3] bristles of `BRISTLE_MM` across each box, and their amplitude on color and height (pixels).

    They fade out in boxes hardly wider than `BRISTLES` of them, and where pixels do not resolve them.
    """
    bristle = BRISTLE_MM / 25.4 * dpi  # pixels
    counts = np.minimum(2 * boxes.half_extents[:, 1].astype(np.float64) / bristle, MOST_FINE)
    low, high = FINE_FROM
    shares = smoothstep((counts / BRISTLES - low) / (high - low))
    first, whole = BRISTLE_FADE
    shares *= smoothstep(np.array((bristle - first) / (whole - first)))
    if is_smooth is not None:
        shares[is_smooth] = 0
    heights = shares * (FINE_GAIN / 25.4 * dpi if relief else 0.0)
    fine = np.stack([counts, FINE_STREAKS * streaks * shares, heights], axis=1)
    return fine.astype(boxes.half_extents.dtype)


def streak_starts(boxes: Boxes) -> NDArray[np.uint8]:
    """[M] offset of each box into the noise, bristles."""
    return starts_of(boxes.ids)


def starts_of(ids: NDArray[np.integer[Any]]) -> NDArray[np.uint8]:
    """[M] offsets into the noise for rows: a hash."""
    return (ids.astype(np.uint32) * np.uint32(0x9E3779B1) >> np.uint32(24)).astype(np.uint8)


def streak_weights(boxes: Boxes, streaks: float, is_smooth: NDArray[np.bool_] | None = None) -> Array:
    """[M, 2] amplitude of bristles and of tufts in each box, >= 0, in total at most `streaks`.

    Boxes in the mask `is_smooth` [M] have none; None for no such box.
    """
    return _weights(boxes, streaks, 0, is_smooth)


def streak_slopes(boxes: Boxes, streaks: float, is_smooth: NDArray[np.bool_] | None = None) -> Array | None:
    """[M, 2] derivative of the weights by the half extent across the stroke, 1/px; None without streaks."""
    return None if streaks == 0 else _weights(boxes, streaks, 1, is_smooth)


def _weights(boxes: Boxes, streaks: float, derivative: int, is_smooth: NDArray[np.bool_] | None) -> Array:
    half_v = boxes.half_extents[:, 1].astype(np.float64)
    bristles, tufts = (_shown(half_v, fade)[derivative] for fade in (BRISTLE_FADE, TUFT_FADE))
    weights = streaks * np.stack([bristles, tufts - bristles], 1)
    if is_smooth is not None:
        weights[is_smooth] = 0
    return weights.astype(boxes.half_extents.dtype)


def check_streaks(where: str, streaks: float) -> None:
    """Raise ValueError if an amplitude is out of range."""
    if not 0 <= streaks <= MOST_STREAKS:
        raise ValueError(f"{where}: streaks must be in 0 to {MOST_STREAKS}, got {streaks}")


def _shown(half_v: F64, fade: tuple[float, float]) -> tuple[F64, F64]:
    """[M] strength of a band in boxes of these half extents, and its derivative."""
    bristle = 2 / BRISTLES  # pixels of a bristle, per pixel of half extent
    t = np.clip((half_v * bristle - fade[0]) / (fade[1] - fade[0]), 0, 1)
    return t * t * (3 - 2 * t), 6 * t * (1 - t) * bristle / (fade[1] - fade[0])


@lru_cache
def noise() -> NDArray[np.uint8]:
    """[PERIOD, 2] noise of bristles (all bands) and of tufts; 127.5 is 0, 255 is 1.

    The second half of the period is the negated first, so the mean is 0. Standard deviations are 0.5.
    """
    k = np.arange(PERIOD // 2, dtype=np.uint64) + 1
    for factor in (0x9E3779B1, 0x85EBCA6B, 0xC2B2AE35):  # an integer hash: the same on every machine
        k = k * np.uint64(factor) & np.uint64(0xFFFFFFFF)
        k ^= k >> np.uint64(15)
    single = k.astype(np.float64) / 2**31 - 1
    single = np.concatenate([single, -single])
    window = np.sin(np.pi * (np.arange(TUFT) + 0.5) / TUFT) ** 2
    tufts = sum(w * np.roll(single, j - TUFT // 2) for j, w in enumerate(window))
    tufts = 0.5 * tufts / np.sqrt((tufts**2).mean())
    whole = 0.7 * tufts + 0.6 * single
    steps: NDArray[np.uint8] = np.rint(127.5 * (1 + np.clip(np.stack([whole, tufts], 1), -1, 1))).astype(
        np.uint8
    )
    steps[PERIOD // 2 :] = 255 - steps[: PERIOD // 2]
    steps.flags.writeable = False
    return steps


@lru_cache
def packed_noise() -> NDArray[np.uint16]:
    """The noise for the core, see `StreakView` in core/include/brushgs/raster.hpp.

    Entry 2 k packs the bristles k - MARGIN and k - MARGIN + 1 of the first column, entry 2 k + 1 those of the
    second, enough for any box at any offset.
    """
    places = np.arange(-MARGIN, PERIOD + BRISTLES + MARGIN + 2)
    steps = noise().astype(np.uint16)
    packed = steps[places % PERIOD] | steps[(places + 1) % PERIOD] << 8
    return packed.ravel().astype(np.uint16)
