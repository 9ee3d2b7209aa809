"""The surface around each stroke, for choosing brushes: its roughness, and whether it is smooth and light.

A painter lays a light wall with a knife and drags fur with a dry brush. Materials are not known, but strokes
of fur, leaves and gravel have varying normals, colors and sizes; those of walls, paper and skin are alike.
So a stroke is compared with its nearest neighbors, and the differences are averaged over the neighborhood:
roughness belongs to a surface, not to a stroke, and the outline of a smooth object, where only one side of a
stroke differs, is less rough than fur.

The result depends only on the strokes in space, not on views, order or unit.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.values.arrays import F64
from brushgs.values.colors import CONES_FROM_RGB, OKLAB_FROM_ROOTS
from brushgs.values.gaussians import Gaussians


@dataclass(frozen=True, eq=False)
class Materials:
    """Surfaces of k strokes.

    Rough surfaces are above the median of the scene, smooth ones below; but in a scene of fur alone no half
    is smooth: the middle is 0.4 to 0.55. Thresholds were found on koala, truck, plant, guitar, skull and
    chair, 4000 strokes each: there fur, soil and carved wood are rough; paper, leaves and cushions smooth.

    Attributes:
        roughness: [k] 0 (equal normals, colors and sizes) to 1.
        smooth: [k] 0 to 1, how far a surface is smooth and light.
        rough: [k] 0 to 1, how far it is rough; one of both is 0.
    """

    roughness: F64
    smooth: F64
    rough: F64

    @classmethod
    def of(cls, strokes: Gaussians) -> "Materials":
        """Find the surfaces of k strokes; one alone is smooth."""
        return cls(*map(np.asarray, _core.surfaces_of(**brush_arguments(strokes))))


def brush_arguments(strokes: Gaussians) -> dict[str, Any]:
    """Strokes as the core takes them to choose their brushes: `BrushedStrokes`."""
    columns = {name: np.ascontiguousarray(values) for name, values in strokes.columns().items()}
    matrices = {"cones_from_rgb": CONES_FROM_RGB, "lab_from_roots": OKLAB_FROM_ROOTS}
    return {**columns, **matrices, "num_threads": num_threads_or_default(None)}
