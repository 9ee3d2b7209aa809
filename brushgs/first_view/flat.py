"""Views of flat objects (a plate, a comb, a relief; standing or lying) onto their face.

A mirror plane does not find the face of a thin object: its own plane is the best mirror plane.
"""

from dataclasses import replace

import numpy as np

from brushgs.cameras.framing import FLAT_HEIGHT, camera_axes, weighted_quantiles
from brushgs.first_view.front import LEAN, wrapped
from brushgs.first_view.sample import thinned
from brushgs.values.camera import FirstView
from brushgs.values.gaussians import Gaussians

# Depth over the larger of width and height below which a standing object is thin: real scenes have 0.31 and
# more.
THIN = 0.15
# Least share of the height that the bulk of a lying flat object fills. A campsite from the air, with trees,
# has 0.18; a plate, a comb, a relief 0.7 and more.
FILLED = 0.4
MOST = (0.1, 0.9)  # opacity quantiles of the bulk of an object
FACE_ELEVATION = np.radians(62.0)
ELONGATED = 0.6  # width over length below which a lying object is seen with its length across the picture
FACING = np.radians(15.0)  # a front this close to the direction of the face stays
AZIMUTHS = np.radians(np.arange(180.0))
MOST_ROWS = 50_000


def is_lying(gaussians: Gaussians, view: FirstView) -> bool:
    """Whether a scene is a thin lying object, not land with objects on it.

    Args:
        gaussians: N >= 1 Gaussians.
        view: of the scene, from outside.
    """
    level = camera_axes(view.up, 0.0, 0.0)
    width, height, depth = np.ptp(view.points @ level.T, axis=0)
    if view.has_surroundings or height >= FLAT_HEIGHT * max(width, depth):
        return False
    rows = thinned(len(gaussians), MOST_ROWS)
    low, high = view.points.min(axis=0), view.points.max(axis=0)
    means, weights = gaussians.means[rows].astype(np.float64), gaussians.opacities[rows].astype(np.float64)
    is_inside = ((means >= low) & (means <= high)).all(axis=1) & (weights > 0)
    if not is_inside.any():
        return False
    below, above = weighted_quantiles(means[is_inside] @ level[1], weights[is_inside], MOST)
    return bool(above - below >= FILLED * height)


def facing(view: FirstView) -> FirstView:
    """The view turned to the face of a thin standing object, or across the length of a lying one.

    Args:
        view: of an object, with its front; the side of the face is the one nearer to its azimuth.
    """
    places = view.points @ camera_axes(view.up, 0.0, 0.0).T
    depths = np.ptp(places[:, [0, 2]] @ np.stack([np.sin(AZIMUTHS), -np.cos(AZIMUTHS)]), axis=0)
    length, height = float(depths.max()), float(np.ptp(places[:, 1]))
    is_flat = view.elevation == FACE_ELEVATION
    if depths.min() >= (ELONGATED * length if is_flat else THIN * max(length, height)):
        return view
    face = _nearer(float(AZIMUTHS[depths.argmin()]), view.azimuth)
    if abs(wrapped(view.front - face)) <= FACING:
        return view
    lean = LEAN if wrapped(view.azimuth - face) >= 0 else -LEAN
    return replace(view, azimuth=wrapped(face + lean), front=wrapped(face), is_front_sure=False)


def _nearer(azimuth: float, to: float) -> float:
    """An azimuth or its opposite, whichever is nearer to another."""
    return azimuth if np.cos(azimuth - to) >= 0 else azimuth + np.pi
