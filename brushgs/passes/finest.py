"""Area in pictures: nothing is drawn thinner than the low-pass of the renderer.

A needle has no area, but is drawn as a line with the width of the low-pass (0.3 pixels squared); in some
captured scenes one Gaussian in five is a needle. That width in world units, `Gaussians.finest`, depends on
the viewing distance. Code that weighs, merges or compares the paint of Gaussians takes their scales from
here.

A disc keeps its area although it is thinner still: from its edge it would show a line, but in captured scenes
discs are surfaces, and lines at their edges cost the skull 0.2 dB.
"""

from collections.abc import Iterable

import numpy as np

from brushgs.cameras.framing import DEFAULT_FOV_Y
from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.passes.extent import robust_frame
from brushgs.rendering.project import LOW_PASS
from brushgs.values.arrays import F64, Array
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

ROWS = 720  # of the picture that strokes are made for; strokes do not depend on the actual size
DISTANCE = 2.4  # viewing distance in radii of a scene if no view is known
INSIDE = 0.5  # radii: distance of surfaces from a camera in the middle of a scene


def finest_of(gaussians: Gaussians, cameras: Iterable[Camera] | None = None) -> float:
    """Standard deviation of the finest line in pictures of Gaussians, world units, >= 0.

    It is `Gaussians.finest` if known, and 0 for antialiased Gaussians, which get fainter instead of thicker.

    Args:
        gaussians: N Gaussians.
        cameras: at least one, of which the median counts; None for the default lens at `DISTANCE`.
    """
    if gaussians.antialiased:
        return 0.0
    if gaussians.finest is not None:
        return gaussians.finest
    center, radius = robust_frame(gaussians.means)
    if cameras is None:
        return usual_finest(radius)
    depths = [float(c.viewmat[2, :3] @ center + c.viewmat[2, 3]) for c in cameras]
    heights = [c.height / c.K[1, 1] for c in cameras]
    return _low_pass(float(np.median(np.maximum(depths, INSIDE * radius) * heights)))


def usual_finest(radius: float) -> float:
    """`finest_of` a scene of this radius in world units, without a known view."""
    return _low_pass(2 * float(np.tan(0.5 * DEFAULT_FOV_Y)) * DISTANCE * radius)


def _low_pass(height: float) -> float:
    """Standard deviation of the low-pass if the height of a picture is `height` world units."""
    return float(np.sqrt(LOW_PASS)) * height / ROWS


def seen_scales(scales: Array, finest: float) -> F64:
    """Visible standard deviations of Gaussians, [N, 3] float64, world units, along their axes.

    Gaussians with a middle axis below `finest` get at least that thickness, needles in both directions. The
    result is continuous as a disc narrows to a needle.
    """
    seen = _core.seen_scales(np.ascontiguousarray(scales), finest, num_threads_or_default(None))
    return np.asarray(seen)
