"""Probabilities of the six axes to be up.

Photographs are taken from above and from the side, so undersides are badly trained: seen from below Gaussians
are large and edges few. Objects stand on a foot below a low center of mass, and on something level. Most
trainers keep the axes of COLMAP, where up is -y.

Priors, and all weights but the last two (fixed at 0.5), were fitted on 28 trained scenes. On 12 scenes, most
of them among the 28, each in all 24 axis rotations weighted by prior, `believed_up`
is right in 90 %, without the last two kinds in 86 %; taking the default if the best axis is below `SURE`, 77
and 72 %. With weights refitted leaving out the judged scene, 93 and 86 %. Not useful: view dependence,
brightness and color, opacity, roughness; nor a narrower, more textured or less forked upper end, in
leave-one-out selection.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np

from brushgs.cameras.framing import AXES, DEFAULT_UP, weighted_quantiles
from brushgs.core.threads import side_by_side
from brushgs.first_view.sample import (
    Painter,
    Sample,
    gradients,
    shaded,
    unpremultiplied,
)
from brushgs.values.arrays import F64
from brushgs.values.colors import LUMINANCE
from brushgs.values.quats import shortest_axes
from brushgs.values.sh import base_colors

SURE = 0.85  # probability from which the best axis is taken without a note
# The default axis stays unless the best one is this many times as probable.
FAR_BETTER = 2.0
# How often trained scenes have each axis up, among 51.
PRIORS = {"-y": 0.58, "+z": 0.17, "+y": 0.15, "-z": 0.04, "+x": 0.03, "-x": 0.03}
# Below this many rows a scene is a fragment: its probability is limited.
FEW_ROWS, MOST_OF_FEW = 5_000, 0.8
SEEN = 0.5  # alpha from which a pixel shows the subject
FOOT, LOWEST = 0.1, 0.04  # height share of the foot; share of rows that a scene stands on
FLAT = 2.0  # least ratio of middle to smallest scale for a normal
LEVEL = np.cos(np.radians(20.0))  # cosine between a level normal and the axis


@dataclass(frozen=True)
class Evidence:
    """One kind of evidence for an axis: its typical size over scenes, and its weight in log odds."""

    scale: float
    weight: float

    def score(self, value: F64) -> F64:
        """Log odds of values, saturating for large ones."""
        return np.asarray(self.weight * 1.5 * np.tanh(value / (1.5 * self.scale)))


EVIDENCE = {
    "size": Evidence(0.060, -0.90),
    "size_at_pole": Evidence(0.102, -0.95),
    "edges": Evidence(0.017, 0.38),
    "edges_at_pole": Evidence(0.026, 0.19),
    "stable": Evidence(0.208, 0.51),
    "foot": Evidence(0.691, 0.46),
    "low_mass": Evidence(0.103, 0.5),
    "low_ground": Evidence(0.109, 0.5),
}
# Axes, edges and corners of a cube: 26.
DIRECTIONS = np.array([d for d in product((-1, 0, 1), repeat=3) if any(d)], dtype=np.float64)
DIRECTIONS /= np.linalg.norm(DIRECTIONS, axis=1, keepdims=True)


Ups = tuple[tuple[str, float], ...]  # names of axes with probabilities, the most probable first


def up_probabilities(sample: Sample | None) -> Ups:
    """The six axes with the probability that they are up, the most probable first.

    Args:
        sample: None if nothing is visible: priors alone.
    """
    evidence = np.zeros(len(AXES)) if sample is None else up_evidence(sample)
    odds = np.log([PRIORS[axis] for axis in AXES]) + evidence
    chances = np.exp(odds - odds.max())
    chances /= chances.sum()
    best = chances.argmax()
    if sample is not None and sample.num_rows < FEW_ROWS and chances[best] > MOST_OF_FEW:
        chances *= (1 - MOST_OF_FEW) / (chances.sum() - chances[best])
        chances[best] = MOST_OF_FEW
    return ranked(dict(zip(AXES, chances.tolist(), strict=True)))


def ranked(chances: dict[str, float]) -> Ups:
    """Axes by descending probability."""
    return tuple(sorted(chances.items(), key=lambda item: -item[1]))


def believed_up(ups: Ups) -> tuple[str, float]:
    """The axis to take and its probability: the best one, unless the default is nearly as probable."""
    best, probability = ups[0]
    default = dict(ups)[DEFAULT_UP]
    return (best, probability) if probability > FAR_BETTER * default else (DEFAULT_UP, default)


def ranking_text(ups: Ups, taken: str) -> str:
    """The two most probable axes, and the chosen one if different, as "+y 0.68, -y 0.12"."""
    shown = [pair for rank, pair in enumerate(ups) if rank < 2 or pair[0] == taken]
    return ", ".join(f"{name} {share:.2f}" for name, share in shown)


def up_evidence(sample: Sample) -> F64:
    """[6] log odds of each of `AXES` without priors; they rotate with the scene."""
    values = measure_up(sample)
    return np.asarray(sum(EVIDENCE[kind].score(value) for kind, value in values.items()))


def measure_up(sample: Sample) -> dict[str, F64]:
    """The [6] values of each kind of evidence, for each of `AXES`."""
    edges, sizes = _look_around(sample)
    places, weights = sample.places, sample.weights
    normals, flat = _normals(sample)
    values: dict[str, list[float]] = {kind: [] for kind in EVIDENCE if kind != "stable"}
    for up in np.eye(3):
        height = DIRECTIONS @ up
        above, below = height > 0.1, height < -0.1
        top, bottom = height > 0.99, height < -0.99
        values["size"].append(sizes[above].mean() - sizes[below].mean())
        values["size_at_pole"].append(sizes[top].mean() - sizes[bottom].mean())
        values["edges"].append(edges[above].mean() - edges[below].mean())
        values["edges_at_pole"].append(edges[top].mean() - edges[bottom].mean())
        level, heights = places[:, up == 0], places @ up
        low, high = weighted_quantiles(heights, weights, (0.01, 0.99))
        values["foot"].append(_foot(heights, level, low, high))
        shares = np.clip((heights - low) / ((high - low) or 1.0), 0, 1)
        values["low_mass"].append(0.5 - float(shares @ weights) / (weights.sum() or 1.0))
        is_level = np.abs(normals @ up) > LEVEL
        values["low_ground"].append(_lower_share(shares, flat * is_level, float(flat.sum())))
    # Opposite axes have negated values, except stability.
    evidence = {kind: np.array([*column, *np.negative(column)]) for kind, column in values.items()}
    ups = np.array(list(AXES.values()))
    stable = [_stability(places @ up, places[:, up == 0], weights) for up in ups]
    return evidence | {"stable": np.array(stable)}


def _look_around(sample: Sample) -> tuple[F64, F64]:
    """Edges per pixel and mean shade of size of pictures from `DIRECTIONS`."""
    paint = Painter()
    shades = base_colors(sample.gaussians.sh) @ LUMINANCE
    gaussians = shaded(sample.gaussians, shades, sample.shades_of_size)

    def look(direction: F64) -> tuple[float, float]:
        frame = paint(gaussians, sample.camera(_axes_toward(-direction)))
        shown, mask = unpremultiplied(frame), frame.alpha > SEEN
        if not mask.any():
            return 0.0, 0.0
        edges = gradients(shown[..., 0], mask).sum(dtype=np.float64) / mask.sum()
        return float(edges), float(shown[..., 1][mask].mean(dtype=np.float64))

    edges, sizes = np.array(side_by_side(look, DIRECTIONS)).T
    return edges, sizes


def _axes_toward(forward: F64) -> F64:
    """[3, 3] rows right, down, forward of a view in a direction, with arbitrary roll."""
    right = np.cross(forward, np.eye(3)[np.abs(forward).argmin()])
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])


def _stability(heights: F64, level: F64, weights: F64) -> float:
    """Distance of the center of mass inside the box of the lowest points, in widths of the sample.

    Args:
        heights: [n] upwards.
        level: [n, 2] coordinates across.
        weights: [n].
    """
    lowest = level[heights <= np.quantile(heights, LOWEST)]
    low, high = np.quantile(lowest, (0.05, 0.95), axis=0)
    center = (level * weights[:, None]).sum(axis=0) / (weights.sum() or 1.0)
    widths = np.ptp(level, axis=0)
    widths = np.maximum(widths, 1e-6 * widths.max() or 1.0)
    return float((np.minimum(center - low, high - center) / widths).min())


def _foot(heights: F64, level: F64, low: float, high: float) -> float:
    """Footprint of the lowest tenth minus that of the highest, over the whole footprint."""
    part = FOOT * (high - low)
    whole = _footprint(level) or 1.0
    lowest, highest = level[heights < low + part], level[heights > high - part]
    return (_footprint(lowest) - _footprint(highest)) / whole


def _normals(sample: Sample) -> tuple[F64, F64]:
    """[n, 3] normals of either sign, and [n] painted area, 0 for Gaussians that are not flat."""
    gaussians = sample.gaussians
    scales = np.sort(gaussians.scales, axis=1)
    is_flat = scales[:, 1] > FLAT * scales[:, 0]
    return shortest_axes(gaussians.quats, gaussians.scales), np.asarray(sample.weights * is_flat)


def _lower_share(shares: F64, weights: F64, whole: float) -> float:
    """Weight of the lowest third of the height minus that of the highest, over the whole weight."""
    lower, higher = weights[shares < 1 / 3].sum(), weights[shares > 2 / 3].sum()
    return float(lower - higher) / (whole or 1.0)


def _footprint(level: F64) -> float:
    """Area of the box with 90 % of the points along each axis; 0 for very few points."""
    if len(level) < 10:
        return 0.0
    low, high = np.quantile(level, (0.05, 0.95), axis=0)
    return float(np.prod(high - low))
