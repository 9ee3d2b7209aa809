"""Up of a scene whose axes are a few degrees off: the direction that level surfaces face."""

import numpy as np

from brushgs.arrays import F64
from brushgs.first_view.sample import Sample
from brushgs.quats import rotation_matrices

CONES = (30.0, 20.0, 12.0, 8.0, 8.0)  # degrees around up in which a Gaussian is level, step by step
LEVEL_SHARE = 0.16  # of the flat painted area in the last cone: below, there is no ground to go by
# Degrees. Below, the axis is as good; above, what was found is a slope. Off by at most 1 degree on 51 scenes.
LEAST, MOST = 1.5, 30.0


def tilted_up(sample: Sample, up: F64) -> F64:
    """The mean normal [3] of what is level near an axis `up` [3]; the axis where that is not sure."""
    gaussians = sample.gaussians
    scales = np.sort(gaussians.scales.astype(np.float64), axis=1)
    is_flat = scales[:, 1] > 2 * scales[:, 0]
    weights = sample.weights * is_flat
    rows = np.arange(len(gaussians))
    normals = rotation_matrices(gaussians.quats)[rows, :, gaussians.scales.argmin(axis=1)]
    found = up
    for cone in CONES:
        cosines = normals @ found
        is_level = np.abs(cosines) > np.cos(np.radians(cone))
        total = (normals * (np.sign(cosines) * weights * is_level)[:, None]).sum(axis=0)
        length = float(np.linalg.norm(total))
        if not length > 0:
            return up
        found = total / length
    is_level = np.abs(normals @ found) > np.cos(np.radians(CONES[-1]))
    tilt = np.degrees(np.arccos(min(float(found @ up), 1.0)))
    is_sure = weights[is_level].sum() >= LEVEL_SHARE * weights.sum() and LEAST < tilt <= MOST
    return np.asarray(found) if is_sure else up
