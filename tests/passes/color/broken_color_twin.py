"""Broken color in NumPy."""

from math import prod

import numpy as np

from brushgs.passes.color.tone import painted_areas
from brushgs.passes.form.coverage import nearest_others
from brushgs.values.arrays import smoothstep
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.hashing import GOLDEN, uniform
from brushgs.values.sh import C0

COLORFUL, ALONG, ACROSS = 0.08, 1.3, 0.55
NUM_AROUND = 8
_BISECTIONS = 8


def base_colors(strokes, lightness, chroma, follows, seed):
    """The base colors [k, 3] of `break_colors`, before and after."""
    colors = 0.5 + C0 * strokes.sh[:, 0].astype(np.float64)
    lab = oklab_of(colors)
    shifts = _normals(strokes.means, seed) * (lightness, chroma, chroma)
    shifts *= _room(colors, lab, shifts)[:, None]
    shifts -= _means_around(strokes, shifts)
    if follows:
        shifts[:, 1:] += follows * (_followed(lab, shifts[:, 1:]) - shifts[:, 1:])
    shifts *= _room(colors, lab, shifts)[:, None]
    after = rgb_of_oklab(lab + shifts)
    return colors, np.clip(after, np.minimum(colors, 0.0), np.maximum(colors, 1.0))


def row_hashes(*columns):
    """A hash [N] of the bits of each row of columns [N, ...], taken as float32; 0 and -0 are the same."""
    hashes = np.zeros(len(columns[0]), np.uint64)
    flat = [values for column in columns for values in column.reshape(len(column), prod(column.shape[1:])).T]
    for place, values in enumerate(flat, 1):
        bits = (values.astype(np.float32) + np.float32(0)).view(np.uint32)  # -0 is 0
        mixed = (bits.astype(np.uint64) + np.uint64(place * GOLDEN % 2**64)) * np.uint64(GOLDEN)
        hashes = (hashes ^ mixed ^ (mixed >> np.uint64(29))) * np.uint64(GOLDEN)
        hashes ^= hashes >> np.uint64(32)
    return hashes


def chances(places, seed, draw):
    states = (row_hashes(places) ^ np.uint64(seed * GOLDEN % 2**64)) + np.uint64((draw + 1) * GOLDEN % 2**64)
    return uniform(states)


def _normals(means, seed):
    """Three normal random numbers per position, [k, 3]."""
    uniform = np.stack([chances(means, seed, draw) for draw in range(4)])
    first, second = np.sqrt(-2 * np.log1p(-uniform[:2])) * np.exp(2j * np.pi * uniform[2:])
    return np.stack([first.real, first.imag, second.real], axis=1)  # Box and Muller 1958


def _followed(lab, shifts):
    """Shifts [k, 2] of a and b, scaled by the colors [k, 3]."""
    chromas = np.hypot(lab[:, 1], lab[:, 2])
    along = lab[:, 1:] / np.maximum(chromas, np.finfo(np.float64).tiny)[:, None]
    lengths = (shifts * along).sum(axis=1, keepdims=True)
    followed = ACROSS * shifts + (ALONG - ACROSS) * lengths * along
    return smoothstep(chromas / COLORFUL)[:, None] * followed


def _means_around(strokes, shifts):
    """[k, 3] mean shift of each stroke and its neighbors, weighted by painted area times opacity."""
    neighbors = nearest_others(strokes.means.astype(np.float64), NUM_AROUND)
    rows = np.concatenate([np.arange(len(strokes))[:, None], neighbors], axis=1)
    weights = painted_areas(strokes)[rows]
    totals = weights.sum(axis=1, keepdims=True)
    weights = np.where(totals > 0, weights / np.where(totals > 0, totals, 1), 1 / rows.shape[1])
    return np.einsum("kn,kni->ki", weights, shifts[rows])


def _room(colors, lab, shifts):
    """[k] largest factor of each shift, 0 to 1, that keeps both directions within the display range."""
    low, high = np.minimum(colors, 0), np.maximum(colors, 1)

    def fits(shares, rows):
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
