"""Strokes that move, for tests: each by a rigid motion of its own around its center."""

import numpy as np

from brushgs.rendering.motion import OPACITY, SHIFT, SIZE, TURN, StrokeMotion, new_table
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import quat_products


def with_ids(strokes: Gaussians, ids=None) -> Gaussians:
    columns = strokes.columns()
    ids = np.arange(len(strokes)) if ids is None else ids
    return Gaussians(**columns, ids=np.asarray(ids, np.int32))


def turn_about(axes, angles) -> np.ndarray:
    """Quaternions [..., 4] of turns by `angles` [...] about `axes`, of any length above zero."""
    axes = np.asarray(axes, np.float64)
    axes = axes / np.linalg.norm(axes, axis=-1, keepdims=True)
    half = 0.5 * np.asarray(angles, np.float64)[..., None]
    return np.concatenate([np.cos(half), np.sin(half) * axes], axis=-1)


def motion_of(strokes: Gaussians, turns, *, shifts=None, sizes=None, opacities=None) -> StrokeMotion:
    """Of strokes with ascending ids: `turns` [T, N, 4] about their centers, and `shifts` [T, N, 3]."""
    turns = np.asarray(turns, np.float64)
    table = new_table(len(turns), len(strokes))
    for t in range(1, len(turns)):  # one half of the sphere, as motions have it
        turns[t] *= np.where((turns[t] * turns[t - 1]).sum(axis=-1, keepdims=True) < 0, -1, 1)
    table[..., TURN] = turns
    for part, values in ((SHIFT, shifts), (SIZE, sizes), (OPACITY, opacities)):
        if values is not None:
            table[..., part] = values
    return StrokeMotion(np.arange(len(turns)) / 30, strokes.ids, strokes.means.astype(np.float64), table)


def tumbling(strokes: Gaussians, num_times: int, *, degrees: float, seed: int = 0) -> StrokeMotion:
    """Each turns about an axis of its own that wanders, at up to so many degrees a step, and drifts."""
    g = np.random.default_rng(seed)
    n = len(strokes)
    turns, axes = np.zeros((num_times, n, 4)), g.normal(size=(n, 3))
    turns[0, :, 0] = 1
    rates = np.radians(degrees) * g.uniform(0.2, 1, n)
    for t in range(1, num_times):
        axes += 0.1 * g.normal(size=(n, 3))
        turns[t] = quat_products(turn_about(axes, rates), turns[t - 1])
    way = np.linspace(0, 1, num_times)[:, None, None]
    return motion_of(strokes, turns, shifts=way * g.normal(size=(n, 3)) * 0.5)
