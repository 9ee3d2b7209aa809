"""The tone of strokes, and grading of their colors.

Drawing media have few tones, so the tone of a stroke is not its lightness: it contrasts with neighbors in
space, and all tones are used. Both are decided once per job, from the strokes alone.
"""

from dataclasses import replace

import numpy as np

from brushgs.core.native import core as _core
from brushgs.passes.form.coverage import NUM_NEIGHBORS, nearest_others
from brushgs.values.arrays import F64
from brushgs.values.colors import CONES_FROM_RGB, OKLAB_FROM_ROOTS, oklab_of
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors

NUM_MASS_ROUNDS = 3  # of means over the nearest 16
ALIKE = 0.1  # difference of tones that are one mass, standard deviation
NUM_ROUNDS = 6  # of means over the nearest 16: in total some 100 neighbors
LOCAL_RANGE = 1.4  # deviations from neighbors that are almost black or white
LEAST_SPREAD = 0.05  # OKLab L: a smaller spread counts as flat
DARKEST, LIGHTEST = 0.04, 0.93  # shares of the painted area that become black and white
ENDS_SEEN = 0.015, 0.985  # the same for visible areas, without hidden and distant paint
LEAST_RANGE = 0.15  # minimum OKLab L between them: a scene of one tone is not stretched


def grade(
    strokes: Gaussians,
    *,
    chroma: float = 1.0,
    contrast: float = 1.0,
    pivot: float = 0.6,
    shadows: tuple[float, float] = (0.0, 0.0),
    lights: tuple[float, float] = (0.0, 0.0),
) -> Gaussians:
    """Grade the colors of strokes in OKLab.

    Args:
        strokes: k strokes.
        chroma: factor on a and b, >= 0.
        contrast: factor on the distance of L from `pivot`, >= 0.
        pivot: OKLab L that contrast does not change.
        shadows: (a, b) shift of dark colors, in full at L 0.22 and below.
        lights: (a, b) shift of light colors, in full at L 0.97 and above.

    Returns:
        The strokes with other view-independent colors; the input itself if nothing changes.
    """
    if len(strokes) == 0 or (chroma == contrast == 1 and not any((*shadows, *lights))):
        return strokes
    sh = strokes.sh.copy()
    _core.grade(
        chroma=chroma,
        contrast=contrast,
        pivot=pivot,
        shadows=shadows,
        lights=lights,
        cones_from_rgb=CONES_FROM_RGB,
        lab_from_roots=OKLAB_FROM_ROOTS,
        sh=sh,
    )
    return replace(strokes, sh=sh)


def tones(
    strokes: Gaussians,
    *,
    local: float = 0.5,
    equalized: float = 0.5,
    areas: F64 | None = None,
    ends: tuple[float, float] = (DARKEST, LIGHTEST),
) -> F64:
    """The tone of each stroke, [k] 0 (black) to 1 (white).

    Args:
        strokes: k strokes.
        local: 0 to 1: share of the tone relative to neighbors, in units of their spread; the rest is the
            lightness in the whole scene.
        equalized: 0 to 1: share of the latter that is the rank of the stroke by painted area, so that all
            tones are used equally; the rest is its position between the darkest 4 % and the lightest 7 %.
        areas: [k] of paint, such as views show it, any unit; None for `painted_areas`.
        ends: shares of it that become black and white.
    """
    if len(strokes) == 0:
        return np.empty(0)
    lightness = oklab_of(base_colors(strokes.sh))[:, 0]
    paint = areas if areas is not None and areas.any() else painted_areas(strokes)
    order = np.argsort(lightness, kind="stable")
    shares = np.cumsum(paint[order])
    shares /= max(shares[-1], np.finfo(np.float64).tiny)
    places = np.searchsorted(shares, ends)
    low, high = lightness[order[np.minimum(places, len(order) - 1)]]
    missing = max(LEAST_RANGE - (high - low), 0.0)
    equalized *= 1 - missing / LEAST_RANGE  # ranks of equal tones say nothing
    low = low * (1 - missing)  # so that the tone of a scene of one lightness is that lightness
    plain = np.clip((lightness - low) / max(high - low, LEAST_RANGE), 0, 1)
    ranks = np.empty(len(order))
    ranks[order] = shares
    tone = (1 - equalized) * plain + equalized * ranks
    return np.asarray((1 - local) * tone + local * _local_tones(strokes, lightness, paint) if local else tone)


def masses(strokes: Gaussians, tones: F64, areas: F64) -> F64:
    """Tones of the large masses that strokes belong to: means over neighbors of nearly their own tone.

    A bilateral filter over strokes in space instead of pixels, so it is the same in every view.
    Source: Tomasi and Manduchi 1998.

    Args:
        strokes: k strokes.
        tones: [k] of them.
        areas: [k] of paint, the weights.

    Returns:
        [k] 0 to 1.
    """
    others = nearest_others(strokes.means.astype(np.float64), NUM_NEIGHBORS)
    rows = np.concatenate([np.arange(len(strokes))[:, None], others], axis=1)
    weights = (np.sqrt(areas) + np.finfo(np.float64).tiny)[rows]
    for _ in range(NUM_MASS_ROUNDS):
        alike = weights * np.exp(-0.5 * ((tones[rows] - tones[:, None]) / ALIKE) ** 2)
        tones = (alike * tones[rows]).sum(axis=1) / alike.sum(axis=1)
    return tones


def painted_areas(strokes: Gaussians) -> F64:
    """[k] opacity times the product of the two largest scales, relative to the largest stroke: 0 to 1."""
    scales = np.sort(strokes.scales, axis=1)[:, 1:].astype(np.float64)
    scales /= max(float(scales.max(initial=0)), np.finfo(np.float64).tiny)
    return np.asarray(strokes.opacities * scales[:, 0] * scales[:, 1])


def _local_tones(strokes: Gaussians, lightness: F64, paint: F64) -> F64:
    """[k] 0 to 1: 1/2 if as light as the neighbors, less if darker."""
    others = nearest_others(strokes.means.astype(np.float64), NUM_NEIGHBORS)
    rows = np.concatenate([np.arange(len(strokes))[:, None], others], axis=1)
    weights = np.sqrt(paint) + np.finfo(np.float64).tiny
    weights = weights[rows] / weights[rows].sum(axis=1, keepdims=True)

    def mean_around(values: F64) -> F64:
        for _ in range(NUM_ROUNDS):
            values = np.einsum("kn,kn->k", weights, values[rows])
        return values

    away = lightness - mean_around(lightness)
    spread = np.sqrt(np.maximum(mean_around(away**2), 0))
    return np.asarray(0.5 + 0.5 * np.tanh(away / (LOCAL_RANGE * np.maximum(spread, LEAST_SPREAD))))
