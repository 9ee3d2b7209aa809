"""One order of strokes for all frames of a film: none passes another, so nothing has to fade.

It suits strokes on a surface that is seen from one side, such as a stage: there any order is possible.
"""

from collections.abc import Sequence

import numpy as np

from brushgs.values.arrays import F64, Array
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera

MOST_VIEWS = 64  # evenly spread over a path


def mean_distances(means: Array, cameras: Sequence[Camera]) -> F64:
    """[N] mean distance of positions [N, 3] from the eyes, world units.

    Along a sway that is nearly the order of depths in each view; along an orbit what is nearer to its middle
    comes first.
    """
    eyes = np.array([camera.position for camera in cameras[:: -(-len(cameras) // MOST_VIEWS)]])
    found = np.zeros(len(means))
    for eye in eyes:
        found += np.linalg.norm(means - eye, axis=1) / len(eyes)
    return found


def in_fixed_order(boxes: Boxes, distances: F64) -> Boxes:
    """Boxes at these distances [N] of their strokes in place of their depths, without softness."""
    dtype = boxes.depths.dtype
    found = np.minimum(distances[boxes.ids], np.finfo(dtype).max / 4).astype(dtype)
    order = np.argsort(found, kind="stable")
    return Boxes(**boxes.columns_of(order) | {"depths": found[order], "softness": None})
