"""Colors and brushes of looks, in NumPy."""

import numpy as np

from brushgs.passes.color.tone import painted_areas
from brushgs.passes.form.coverage import nearest_others
from brushgs.passes.reduce.contribution import paint_of
from brushgs.passes.reduce.equal_rows import chances
from brushgs.passes.reduce.lloyd import lloyd
from brushgs.rendering.relief import LEAST_LIGHT_RANGE, light_range
from brushgs.values.arrays import smoothstep
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.quats import shortest_axes
from brushgs.values.sh import base_colors, in_colors, shift_base_colors

SHADOW, LIGHT = (0.62, 0.40), (0.62, 0.35)
HUE = 2.0
NUM_NEIGHBORS, NUM_COMPARED, NUM_ROUNDS = 16, 6, 2
FAR_COLOR, FAR_SIZE, FAR_NORMAL = 0.15, 1.0, 0.8
NORMALS, COLORS, SIZES = (0.1, 0.55), (0.2, 0.7), (0.2, 0.5)
WEIGHTS = np.array([0.5, 0.3, 0.2])
LEAST_MIDDLE, MOST_MIDDLE, WIDTH = 0.4, 0.55, 0.15
LONG, SHORT, LARGE = 1.9, 1.35, 2.2


def grade(strokes, chroma, contrast, pivot, shadows, lights):
    """Strokes in graded colors."""
    colors = base_colors(strokes.sh)
    lab = oklab_of(colors)
    lightness = lab[:, :1]
    dark = np.clip((SHADOW[0] - lightness) / SHADOW[1], 0, 1)
    light = np.clip((lightness - LIGHT[0]) / LIGHT[1], 0, 1)
    shifts = dark * np.asarray(shadows) + light * np.asarray(lights)
    graded = np.hstack([pivot + (lightness - pivot) * contrast, lab[:, 1:] * chroma + shifts])
    return shift_base_colors(strokes, np.clip(rgb_of_oklab(graded), 0, 1) - colors)


def use_pigments(strokes, num_pigments, share, seed):
    """Strokes whose colors are near to the means of weighted k-means in OKLab."""
    lab = oklab_of(base_colors(strokes.sh))
    paint = np.sqrt(painted_areas(strokes))
    paint += 1e-12 * (paint.max() or 1.0)
    points = (lab * (1, HUE, HUE)).astype(np.float32)
    labels = lloyd(points, paint, min(num_pigments, len(strokes)), seed=seed).labels
    totals = np.bincount(labels, paint)
    means = np.stack([np.bincount(labels, paint * lab[:, i]) / totals for i in range(3)], axis=1)
    colors = rgb_of_oklab((1 - share) * lab + share * means[labels])
    return in_colors(strokes, np.clip(colors, 0, 1))


def surfaces(strokes):
    """Roughness, and how far surfaces are smooth and light, and rough; [k] each."""
    found = roughness(strokes)
    away = (found - np.clip(_middle(found, paint_of(strokes)), LEAST_MIDDLE, MOST_MIDDLE)) / WIDTH
    dark, light = light_range(strokes)
    lightness = (oklab_of(base_colors(strokes.sh))[:, 0] - dark) / max(light - dark, LEAST_LIGHT_RANGE)
    return found, smoothstep(-away) * smoothstep(lightness), smoothstep(away)


def roughness(strokes):
    """Roughness of the surface around each stroke, [k] 0 (equal normals, colors and sizes) to 1."""
    others = nearest_others(strokes.means.astype(np.float64), NUM_NEIGHBORS).astype(np.intp)
    if others.shape[1] == 0:
        return np.zeros(len(strokes))
    none, full = np.transpose((NORMALS, COLORS, SIZES))[..., None]
    differences = _differences(strokes, others[:, :NUM_COMPARED])
    found = WEIGHTS @ np.clip((differences - none) / (full - none), 0, 1)
    for _ in range(NUM_ROUNDS):
        found = (found + found[others].sum(axis=1)) / (1 + others.shape[1])
    return found


def _differences(strokes, others):
    """[k] mean difference of each stroke from others [k, n]: in normal, color and size, each 0 to 1."""
    normals = shortest_axes(strokes.quats.astype(np.float64), strokes.scales)
    lab = oklab_of(base_colors(strokes.sh))
    scales = np.sort(strokes.scales, axis=1)[:, 1:].astype(np.float64)
    logs = np.log(np.maximum(scales, np.finfo(np.float64).tiny)).sum(axis=1) / 2
    turned = 1 - np.abs(np.einsum("ki,kni->kn", normals, normals[others]))
    away = np.linalg.norm(lab[:, None] - lab[others], axis=2)
    grown = np.abs(logs[:, None] - logs[others])
    return np.clip((turned / FAR_NORMAL, away / FAR_COLOR, grown / FAR_SIZE), 0, 1).mean(axis=2)


def _middle(values, paint):
    """The median of values, weighted by paint."""
    largest = float(paint.max())
    weights = paint / largest if largest > 0 else np.ones(len(values))
    order = np.lexsort((weights, values))
    shares = np.cumsum(weights[order])
    return float(values[order[np.searchsorted(shares, shares[-1] / 2)]])


def choose_brushes(strokes, kit, material, seed):
    """The brush [k] of each stroke."""
    rows = kit.rows()
    scales = np.sort(strokes.scales, axis=1)[:, 1:].astype(np.float64)
    width, length = scales.T
    aspects = np.divide(length, width, out=np.full(len(strokes), np.inf), where=width > 0)
    aspects, sizes = np.where(length > 0, aspects, 1.0), np.sqrt(length) * np.sqrt(width)
    shares, takes = (chances(strokes.means, seed, draw) for draw in (4, 7))
    brushes = np.zeros(len(strokes), np.uint8)
    is_large = sizes > LARGE * np.median(sizes) if len(strokes) else np.zeros(0, bool)
    is_long, is_short = aspects > LONG, aspects < SHORT
    for group, is_in in {"long": is_long, "short": is_short, "other": ~(is_long | is_short)}.items():
        for some, choice in (
            (is_in & ~is_large, rows[group]),
            (is_in & is_large, np.union1d(rows[group], rows["large"])),
        ):
            brushes[some] = choice[(shares[some] * len(choice)).astype(np.intp)]
    if material and len(strokes):
        _, smooth, rough = surfaces(strokes)
        for choice, is_of in (rows["smooth"], smooth), (rows["rough"], rough):
            some = (takes < material * is_of) & (len(choice) > 0)
            brushes[some] = choice[(shares[some] * len(choice)).astype(np.intp)]
    return brushes
