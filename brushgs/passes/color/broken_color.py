"""Broken color: make each stroke a little lighter or darker, warmer or cooler.

Painters do not mix one color for a whole wall; neighboring strokes differ, and the eye mixes them. Every
stroke gets a small normal shift in OKLab minus the mean shift around it, so that local mean colors stay.
Shifts are hashes of position and seed, independent of order and camera. With `follows`, shifts scale with
chroma: grays stay gray and vary only in lightness; pure colors vary in chroma more than in hue.
"""

import operator

import numpy as np

from brushgs.passes.form.coverage import nearest_others
from brushgs.passes.reduce.equal_rows import chances
from brushgs.values.arrays import F64, Array, Mask, Rows, smoothstep
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0, shift_base_colors

# Standard deviations of L, and of a and b, in OKLab. 6000 strokes, mean of six scenes: -0.17 dB (koala -0.3);
# 0.011 and 0.005 cost 0.08 and are hardly visible, 0.022 and 0.010 cost 0.31 and turn fur to confetti.
LIGHTNESS, CHROMA = 0.016, 0.007
# Shifts with `follows`: OKLab chroma of full size (fur and stone have 0.01 to 0.03, skin 0.05 to 0.09, a red
# shirt 0.2), and factors along and across the direction of a and b, with constant sum of squares.
COLORFUL = 0.08
ALONG, ACROSS = 1.3, 0.55
NUM_AROUND = 8  # neighbors whose mean shift, with its own, is subtracted
MOST = 0.5
MAX_SEED = 2**32 - 1
_BISECTIONS = 8


def break_colors(
    strokes: Gaussians,
    lightness: float = LIGHTNESS,
    chroma: float = CHROMA,
    *,
    follows: float = 0.0,
    seed: int = 0,
) -> Gaussians:
    """Vary the colors of strokes; local means stay.

    Only the view-independent part of a color changes. No channel leaves the display range: near black, white
    and pure colors shifts shrink equally in both directions, and colors outside do not move further out.
    White paper stays white.

    Args:
        strokes: k strokes.
        lightness: standard deviation of the shift of OKLab L, 0 (black) to 1 (white); 0 to 0.5.
        chroma: standard deviation of the shifts of OKLab a and b, likewise.
        follows: 0 (same for all strokes) to 1: scale shifts of a and b with the stroke's chroma, from none
            for a gray to full at 0.08, mostly along its hue.
        seed: 0 to 2^32 - 1.

    Returns:
        The strokes with other `sh`, in the same dtype; the input itself if both deviations are 0 or k = 0.

    Raises:
        TypeError: if `seed` is not an integer.
        ValueError: if an option is out of range.

    Strokes at the same place get the same shift. Scaling or moving the scene gives other shifts.

    Example:
        >>> livelier = bg.break_colors(strokes, 0.05)
        >>> bool((livelier.sh != strokes.sh).any())
        True
    """
    for name, value in (("lightness", lightness), ("chroma", chroma)):
        if not 0 <= value <= MOST:
            raise ValueError(f"break_colors: {name} must be in [0, {MOST}], got {value:g}")
    if not 0 <= follows <= 1:
        raise ValueError(f"break_colors: follows must be in [0, 1], got {follows:g}")
    seed = operator.index(seed)
    if not 0 <= seed <= MAX_SEED:
        raise ValueError(f"break_colors: seed must be in 0 to {MAX_SEED}, got {seed}")
    if len(strokes) == 0 or lightness == chroma == 0:
        return strokes
    colors = 0.5 + C0 * strokes.sh[:, 0].astype(np.float64)
    lab = oklab_of(colors)
    shifts = _normals(strokes.means, seed) * (lightness, chroma, chroma)
    shifts *= _room(colors, lab, shifts)[:, None]
    shifts -= _means_around(strokes, shifts)
    if follows:  # after subtracting means, or a gray would take its neighbors' color
        shifts[:, 1:] += follows * (_followed(lab, shifts[:, 1:]) - shifts[:, 1:])
    shifts *= _room(colors, lab, shifts)[:, None]
    return shift_base_colors(strokes, rgb_of_oklab(lab + shifts) - colors)


def _normals(means: Array, seed: int) -> F64:
    """Three normal random numbers per position, [k, 3]."""
    uniform = np.stack([chances(means, seed, draw) for draw in range(4)])
    radii, turns = np.sqrt(-2 * np.log1p(-uniform[:2])), 2 * np.pi * uniform[2:]  # Box and Muller 1958
    return np.stack(
        [radii[0] * np.cos(turns[0]), radii[0] * np.sin(turns[0]), radii[1] * np.cos(turns[1])], 1
    )


def _followed(lab: F64, shifts: F64) -> F64:
    """Shifts [k, 2] of a and b, scaled by the colors [k, 3]."""
    chromas = np.hypot(lab[:, 1], lab[:, 2])
    along = lab[:, 1:] / np.maximum(chromas, np.finfo(np.float64).tiny)[:, None]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    followed = sum(
        factor * np.einsum("ki,ki->k", shifts, axes)[:, None] * axes
        for factor, axes in ((ALONG, along), (ACROSS, across))
    )
    return np.asarray(smoothstep(chromas / COLORFUL)[:, None] * followed)


def _means_around(strokes: Gaussians, shifts: F64) -> F64:
    """[k, 3] mean shift of each stroke and its neighbors, weighted by painted area times opacity."""
    neighbors = nearest_others(strokes.means.astype(np.float64), NUM_AROUND)
    rows = np.concatenate([np.arange(len(strokes))[:, None], neighbors], axis=1)
    scales = np.sort(strokes.scales, axis=1)[:, 1:].astype(np.float64)
    largest = max(float(scales.max()), np.finfo(np.float64).tiny)
    paint = strokes.opacities * (scales[:, 0] / largest) * (scales[:, 1] / largest)
    weights = paint[rows]
    totals = weights.sum(axis=1, keepdims=True)
    weights = np.where(totals > 0, weights / np.where(totals > 0, totals, 1), 1 / rows.shape[1])
    return np.asarray(np.einsum("kn,kni->ki", weights, shifts[rows]))


def _room(colors: F64, lab: F64, shifts: F64) -> F64:
    """[k] largest factor of each shift, 0 to 1, that keeps both directions within the display range."""
    low, high = np.minimum(colors, 0), np.maximum(colors, 1)

    def fits(shares: F64, rows: Rows) -> Mask:
        inside = np.ones(len(shares), bool)
        for sign in (1, -1):
            moved = rgb_of_oklab(lab[rows] + sign * shares[:, None] * shifts[rows])
            inside &= ((moved >= low[rows] - 1e-9) & (moved <= high[rows] + 1e-9)).all(axis=1)
        return inside

    room = np.ones(len(colors))
    tight = np.flatnonzero(~fits(room, np.arange(len(room))))
    shares, step = np.zeros(len(tight)), 1.0
    for _ in range(_BISECTIONS):
        step /= 2
        shares += step * fits(shares + step, tight)
    room[tight] = shares
    return room
