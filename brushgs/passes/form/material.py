"""The surface around each stroke, for choosing brushes: its roughness, and whether it is smooth and light.

A painter lays a light wall with a knife and drags fur with a dry brush. Materials are not known, but strokes
of fur, leaves and gravel have varying normals, colors and sizes; those of walls, paper and skin are alike.
So a stroke is compared with its nearest neighbors, and the differences are averaged over the neighborhood:
roughness belongs to a surface, not to a stroke, and the outline of a smooth object, where only one side of a
stroke differs, is less rough than fur.

The result depends only on the strokes in space, not on views, order or unit.
"""

from dataclasses import dataclass

import numpy as np

from brushgs.passes.form.coverage import NUM_NEIGHBORS, nearest_others
from brushgs.passes.reduce.contribution import paint_of
from brushgs.rendering.relief import LEAST_LIGHT_RANGE, light_range
from brushgs.values.arrays import F64, Rows, smoothstep
from brushgs.values.colors import oklab_of
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices
from brushgs.values.sh import base_colors

# Found on koala, truck, plant, guitar, skull and chair, 4000 strokes each: there fur, soil and carved wood
# are rough; paper, leaves and cushions smooth.
NUM_COMPARED = 6  # nearest neighbors for comparison
NUM_ROUNDS = 2  # of means over the nearest 16 and the stroke itself
FAR_COLOR = 0.15  # OKLab: larger differences are those of two objects, and are clipped to this
FAR_SIZE = 1.0  # natural logarithm of the ratio of sizes, likewise
FAR_NORMAL = 0.8  # of 1 - |cos| between normals
# Mean differences, in these units, at which roughness begins and is full; and their weights.
NORMALS, COLORS, SIZES = (0.1, 0.55), (0.2, 0.7), (0.2, 0.5)
WEIGHTS = (0.5, 0.3, 0.2)
# Rough surfaces are above the median of the scene, smooth ones below; but in a scene of fur alone no half is
# smooth.
LEAST_MIDDLE, MOST_MIDDLE = 0.4, 0.55
WIDTH = 0.15  # of roughness, from the middle to fully smooth or rough


@dataclass(frozen=True, eq=False)
class Materials:
    """Surfaces of k strokes.

    Attributes:
        roughness: [k] 0 (smooth) to 1.
        smooth: [k] 0 to 1, how far a surface is smooth and light.
        rough: [k] 0 to 1, how far it is rough; one of both is 0.
    """

    roughness: F64
    smooth: F64
    rough: F64

    @classmethod
    def of(cls, strokes: Gaussians) -> "Materials":
        """Find the surfaces of k strokes."""
        if len(strokes) == 0:
            return cls(np.zeros(0), np.zeros(0), np.zeros(0))
        found = roughness(strokes)
        away = (found - np.clip(_middle(found, paint_of(strokes)), LEAST_MIDDLE, MOST_MIDDLE)) / WIDTH
        dark, light = light_range(strokes)
        lightness = (oklab_of(base_colors(strokes.sh))[:, 0] - dark) / max(light - dark, LEAST_LIGHT_RANGE)
        return cls(found, smoothstep(-away) * smoothstep(lightness), smoothstep(away))


def roughness(strokes: Gaussians) -> F64:
    """Roughness of the surface around each stroke, [k] 0 (equal normals, colors and sizes) to 1.

    Args:
        strokes: k strokes; one alone is smooth.
    """
    num = len(strokes)
    others = nearest_others(strokes.means.astype(np.float64), NUM_NEIGHBORS).astype(np.intp)
    if others.shape[1] == 0:
        return np.zeros(num)
    kinds = zip(
        _differences(strokes, others[:, :NUM_COMPARED]), (NORMALS, COLORS, SIZES), WEIGHTS, strict=True
    )
    found = np.zeros(num)
    for differences, (none, full), weight in kinds:
        found += weight * np.clip((differences - none) / (full - none), 0, 1)
    for _ in range(NUM_ROUNDS):
        total = found.copy()
        for rows in others.T:
            total += found[rows]
        found = total / (1 + others.shape[1])
    return found


def _differences(strokes: Gaussians, others: Rows) -> tuple[F64, F64, F64]:
    """[k] mean difference of each stroke from others [k, n]: in normal, color and size, each 0 to 1."""
    thinnest = np.argmin(strokes.scales, axis=1)
    normals = np.take_along_axis(rotation_matrices(strokes.quats), thinnest[:, None, None], axis=2)[:, :, 0]
    lab = oklab_of(base_colors(strokes.sh))
    scales = np.sort(strokes.scales, axis=1)[:, 1:].astype(np.float64)
    logs = np.log(np.maximum(scales, np.finfo(np.float64).tiny)).sum(axis=1) / 2
    found = np.zeros((3, len(strokes)))
    for rows in others.T:
        turned = 1 - np.abs(np.einsum("ki,ki->k", normals, normals[rows]))
        found[0] += np.clip(turned / FAR_NORMAL, 0, 1)
        found[1] += np.minimum(np.linalg.norm(lab - lab[rows], axis=1) / FAR_COLOR, 1)
        found[2] += np.minimum(np.abs(logs - logs[rows]) / FAR_SIZE, 1)
    in_normal, in_color, in_size = found / others.shape[1]
    return in_normal, in_color, in_size


def _middle(values: F64, paint: F64) -> float:
    """The median of values, weighted by paint."""
    largest = float(paint.max())
    weights = paint / largest if largest > 0 else np.ones(len(values))
    order = np.lexsort((weights, values))
    shares = np.cumsum(weights[order])
    return float(values[order[np.searchsorted(shares, shares[-1] / 2)]])
