"""Area as pictures show it: nothing is drawn thinner than the low-pass of the renderer.

A needle has no area, but a picture paints a line of it, as wide as the low-pass (0.3 pixels squared); in
some captured scenes one Gaussian in five is a needle. What that width is in world units depends on the
distance from which strokes are looked at: `Gaussians.finest`. Whatever weighs, merges or compares what
Gaussians paint takes their scales from here.

A disc keeps its area although it is thinner still: seen from its edge it would show a line, but in captured
scenes discs are surfaces, and lines at their edges cost the skull 0.2 dB.
"""

from collections.abc import Iterable

import numpy as np

from brushgs.cameras.framing import DEFAULT_FOV_Y
from brushgs.passes.extent import robust_frame
from brushgs.rendering.project import LOW_PASS
from brushgs.values.arrays import Array
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

ROWS = 720  # of the picture that strokes are made for, whatever its size is: strokes do not depend on that
DISTANCE = 2.4  # radii of a scene from which it is looked at where no view is known
INSIDE = 0.5  # radii: the distance of what a camera in the middle of a scene looks at


def finest_of(gaussians: Gaussians, cameras: Iterable[Camera] | None = None) -> float:
    """Standard deviation of the finest line that pictures show of Gaussians, world units, >= 0.

    It is `Gaussians.finest` where that is known, and 0 for antialiased Gaussians: these get fainter in place
    of thicker.

    Args:
        gaussians: N Gaussians.
        cameras: of some views, at least one, of which the median counts; None for a view through the default
            lens from `DISTANCE`.
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
    """`finest_of` a scene of so many world units that no view is known of."""
    return _low_pass(2 * float(np.tan(0.5 * DEFAULT_FOV_Y)) * DISTANCE * radius)


def _low_pass(height: float) -> float:
    """Its standard deviation where the height of a picture is so many world units."""
    return float(np.sqrt(LOW_PASS)) * height / ROWS


def seen_scales(scales: Array, finest: float) -> Array:
    """Standard deviations of Gaussians as pictures show them, [N, 3], world units, along the own axes.

    Those whose middle axis is thinner than `finest` become as thick as that, needles in both directions; the
    column itself where there are none. As a disc narrows to a needle they change without a jump.
    """
    one, two, three = scales.T
    middle = np.maximum(np.minimum(one, two), np.minimum(np.maximum(one, two), three))
    rows = np.flatnonzero(middle < finest)
    if len(rows) == 0:
        return scales
    seen = scales.astype(np.float64)
    order = np.argsort(seen[rows], axis=1)
    thin, middle, long = np.take_along_axis(seen[rows], order, axis=1).T
    thicker = np.maximum(thin, finest - middle), np.maximum(middle, finest), np.maximum(long, finest)
    for axis, values in zip(order.T, thicker, strict=True):
        seen[rows, axis] = values
    return seen
