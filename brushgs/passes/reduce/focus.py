"""Focus: a factor per Gaussian on the strokes per area, for `cluster(focus=...)`.

Inside the focus the factor is `STRENGTH`, for salient parts `AUTO_STRENGTH`; outside 1, with a smooth edge:
the total number of strokes is unchanged, and the density inside is twice that outside, or up to eight times.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from brushgs.passes.form.saliency import saliency
from brushgs.values.arrays import F64, Array, smoothstep
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.values.marks import Density

STRENGTH = 2.0  # factor on the strokes per area
# For 4000 strokes of a room, 7 gave the face of a cook 6.2 times the density of other parts (1.6 without a
# focus), 12 gave 7.9 times; a toy's nose had 14 times (5.5).
AUTO_STRENGTH = 8.0
LEAST = 0.01  # factor of places painted with less: clusters need weights above 0
EDGE = 0.15  # half width of the smooth edge of a sphere over its radius; that of a box over its half diagonal


def sphere_focus(gaussians: Gaussians, center: ArrayLike, radius: float) -> F64:
    """Factors [N], 1 to `STRENGTH`, of a focus in a sphere; halfway at its surface.

    Args:
        gaussians: N Gaussians.
        center: [3], world units.
        radius: world units, > 0.
    """
    middle = np.asarray(center, np.float64)
    distances = np.linalg.norm(gaussians.means.astype(np.float64) - middle, axis=1)
    return _factors(_inside(distances, radius))


def painted_focus(gaussians: Gaussians, density: "Density") -> F64:
    """Factors [N], at least `LEAST`, of balls that were painted by hand, each with a smooth edge.

    Where balls overlap, the largest factor above 1 counts, times the smallest one below 1: a drag
    covers one place several times, and these must not multiply.

    Args:
        gaussians: N Gaussians.
        density: the balls.
    """
    more, fewer = np.ones(len(gaussians)), np.ones(len(gaussians))
    if len(gaussians) == 0:
        return more
    from scipy.spatial import cKDTree  # its import takes longer than other focuses do

    means = gaussians.means.astype(np.float64)
    tree = cKDTree(means)
    for middle, radius, factor in zip(density.means, density.radii, density.factors, strict=True):
        rows = np.array(tree.query_ball_point(middle, radius * (1 + EDGE)), np.intp)
        distances = np.linalg.norm(means[rows] - middle, axis=1)
        factors = _factors(_inside(distances, radius), factor)
        more[rows], fewer[rows] = np.maximum(more[rows], factors), np.minimum(fewer[rows], factors)
    return np.maximum(more * fewer, LEAST)


def subject_focus(gaussians: Gaussians, view: FirstView) -> F64:
    """Factors [N], 1 to `STRENGTH`, of a focus on the framed subject: the bounds of its points.

    Without surroundings nearly the whole scene is the subject, and the focus has no effect.

    Args:
        gaussians: N Gaussians.
        view: how the scene is seen.
    """
    low, high = view.points.min(axis=0), view.points.max(axis=0)
    means = gaussians.means.astype(np.float64)
    outside = np.linalg.norm(np.maximum(np.maximum(low - means, means - high), 0), axis=1)
    edge = max(EDGE * 0.5 * float(np.linalg.norm(high - low)), np.finfo(np.float64).tiny)
    return _factors(smoothstep(1 - outside / edge))


def auto_focus(gaussians: Gaussians, view: FirstView) -> F64:
    """Factors [N], 1 to `AUTO_STRENGTH`, of a focus on salient parts, see `saliency`.

    Args:
        gaussians: N Gaussians.
        view: how the scene is seen.
    """
    return _factors(saliency(gaussians, view), AUTO_STRENGTH)


def mask_focus(gaussians: Gaussians, camera: Camera, mask: Array, *, num_threads: int | None = None) -> F64:
    """Factors [N], 1 to `STRENGTH`, of a focus on the light parts of a picture of a view.

    Each Gaussian takes the mean of the picture over its pixels, by blending weight. Gaussians that are
    outside the picture or hidden are not in the focus.

    Args:
        gaussians: N Gaussians.
        camera: the view.
        mask: [H, W] in the size of the view, 0 (no focus) to 1.
        num_threads: None takes the processors available to this process. The result does not depend on it.
    """
    from brushgs.passes.where.maps import picture_values

    return _factors(picture_values(gaussians, camera, mask, num_threads=num_threads)[0])


def contrast(factors: Sequence[float] | F64) -> float:
    """The largest factor over the smallest: 1 for a focus without effect."""
    values = np.asarray(factors, np.float64)
    return float(values.max() / values.min()) if len(values) else 1.0


def _inside(distances: F64, radius: float) -> F64:
    """How far points are inside a sphere, 0 to 1, from their distances to its center; 1/2 at its surface."""
    return smoothstep(0.5 - (distances / radius - 1) / (2 * EDGE))


def _factors(share: F64, strength: float = STRENGTH) -> F64:
    return 1 + (strength - 1) * share
