"""Mirror symmetry of a subject about vertical planes: most things are symmetric left to right."""

import numpy as np

from brushgs.first_view.sample import clipped, thinned
from brushgs.values.arrays import F64

NUM_PLANES = 32  # over half a turn
BINS = 28  # voxels along a side of the cube of two radii
SHIFTS = (-0.06, -0.03, 0.0, 0.03, 0.06)  # of the plane from the center of mass, radii
MOST_POINTS = 30_000
LARGEST = 0.98  # quantile at which weights are clipped


def mirror_likeness(places: F64, weights: F64) -> F64:
    """Overlap of the subject with its mirror image, for planes through the vertical axis.

    Args:
        places: [n, 3] to the right, down and forward of a level view, in radii.
        weights: [n] painted area.

    Returns:
        [`NUM_PLANES`] 0 to 1, the best over shifts. Plane i contains the view from azimuth pi i / NUM_PLANES.
    """
    rows = thinned(len(places), MOST_POINTS)
    places, weights = places[rows], clipped(weights[rows], LARGEST)
    if not weights.sum() > 0:
        return np.ones(NUM_PLANES)
    level = places[:, (0, 2)]
    level = level - (level * weights[:, None]).sum(axis=0) / weights.sum()
    heights = _bins(places[:, 1])
    likeness = np.zeros(NUM_PLANES)
    for plane in range(NUM_PLANES):
        angle = np.pi * plane / NUM_PLANES
        across = level @ np.array([np.cos(angle), np.sin(angle)])
        along = _bins(level @ np.array([np.sin(angle), -np.cos(angle)]))
        for shift in SHIFTS:
            cells = (_bins(across - shift) * BINS + along) * BINS + heights
            held = np.bincount(cells, weights=weights, minlength=BINS**3).reshape(BINS, -1)
            held = np.sqrt(held)
            likeness[plane] = max(likeness[plane], np.minimum(held, held[::-1]).sum() / held.sum())
    return likeness


def _bins(coordinates: F64) -> F64:
    """Voxel index of coordinates in -1 to 1."""
    return np.asarray(np.clip(((coordinates + 1) * BINS / 2).astype(np.int64), 0, BINS - 1))
