"""Turn distances into memberships: hard edges, and soft ones of a given width."""

import numpy as np

from brushgs.values.arrays import F64, Array, Mask


def ramp(depths: F64, width: float) -> F64:
    """Memberships [N] for signed distances from an edge.

    Args:
        depths: [N] how far inside, any unit; below 0 outside. 0 is inside.
        width: of the soft edge, in the same unit, half of it to each side; 0 for a hard one.

    Returns:
        0 to 1, at least 1/2 exactly if `depths` is at least 0.
    """
    if not width > 0:
        return (depths >= 0).astype(np.float64)
    return np.clip(0.5 + depths / width, 0.0, 1.0)


def soft_mask(inside: Mask, means: Array, width: float) -> F64:
    """Memberships [N] for a mask, by the distance to the nearest Gaussian of the other side.

    Args:
        inside: [N].
        means: [N, 3] world units.
        width: see `ramp`.
    """
    if not width > 0 or inside.all() or not inside.any():
        return inside.astype(np.float64)
    from scipy.spatial import cKDTree

    from brushgs.core.threads import num_threads_or_default

    points, depths = means.astype(np.float64), np.empty(len(means))
    for side, sign in ((inside, 1.0), (~inside, -1.0)):
        tree = cKDTree(points[~side])
        distances, _ = tree.query(
            points[side], distance_upper_bound=width, workers=num_threads_or_default(None)
        )
        depths[side] = sign * np.minimum(distances, width)  # infinite where none is as near
    return ramp(depths, width)
