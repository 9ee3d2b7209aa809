"""Crumbs: remains of the table below a scanned object.

No photograph saw through the table, so Gaussians below it were not constrained in training: shadow and
reflection of the object, smeared far down. Without the table they are black flecks in the air. They are few
and coarse; their centers lie at the level of the table or below, and they reach lower than anything else.
"""

import numpy as np

from brushgs.cameras.framing import FLAT_ELEVATION, default_elevation
from brushgs.core.native import core as _core
from brushgs.values.arrays import Mask
from brushgs.values.camera import FirstView
from brushgs.values.gaussians import Gaussians


def find_crumbs(gaussians: Gaussians, view: FirstView) -> Mask:
    """[N] mask of the crumbs below an object; empty if the scene is not a single object in a void.

    Also empty if they would have more than 0.15 of the paint: then they are a part that was not framed. The
    underside of a koala's ground has 0.08, a reflection below a pot 0.04.

    Args:
        gaussians: N Gaussians.
        view: first view of the scene: up axis and subject.
    """
    is_flat = default_elevation(view.points, view.up) == FLAT_ELEVATION
    levels = view.points @ view.up
    foot, height = float(levels.min()), float(np.ptp(levels))
    if view.eye is not None or view.has_surroundings or is_flat or not height > 0:
        return np.zeros(len(gaussians), bool)
    marks = _core.find_crumbs(**gaussians.columns(), up=view.up.tolist(), foot=foot, height=height)
    return np.asarray(marks, bool)
