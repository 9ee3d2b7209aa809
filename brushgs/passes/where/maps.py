"""Control maps: turn a value of 0 to 1 for each Gaussian into factors, and carry them to strokes."""

from dataclasses import replace

import numpy as np

from brushgs.passes.color.picture_votes import votes
from brushgs.passes.color.tone import painted_areas
from brushgs.passes.reduce.lloyd import assign
from brushgs.values.arrays import F64, Array, Mask, check
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors, shift_base_colors

LEAST_SEEN = 0.01  # pixels: the view does not show Gaussians with a smaller visible area
NEUTRAL = 0.005  # distance from 1 up to which a factor is 1: 8 bits have no exact middle gray


def picture_values(
    gaussians: Gaussians, camera: Camera, picture: Array, *, num_threads: int | None = None
) -> tuple[F64, Mask]:
    """Values [N], 0 to 1, of a picture of a view, and a mask [N] of the Gaussians that the view shows.

    Each Gaussian takes the mean of the picture over its pixels, by blending weight; 0 if it is not shown.

    Args:
        gaussians: N Gaussians.
        camera: the view.
        picture: [H, W] in the size of the view, 0 to 1.
        num_threads: None takes the processors available to this process. The result does not depend on it.
    """
    check("picture_values", picture=(picture, f"{camera.height} {camera.width}"))
    sums, areas = votes(gaussians, [camera], [picture[..., None]], num_threads=num_threads)
    light, is_seen = np.zeros(len(gaussians)), areas >= LEAST_SEEN
    light[is_seen] = sums[is_seen, 0] / areas[is_seen]
    return np.clip(light, 0, 1), is_seen


def factors_of(values: F64, low: float, high: float) -> F64:
    """Factors [N] from values of 0 to 1, at which they are `low` and `high`.

    Linear; if 1 lies between `low` and `high`, linear from `low` to 1 at a value of 1/2, and on to `high`.
    Factors within `NEUTRAL` of 1 are 1.
    """
    if min(low, high) < 1 < max(low, high):
        below, above = low + (1 - low) * 2 * values, 1 + (high - 1) * (2 * values - 1)
        found = np.where(values < 0.5, below, above)
    else:
        found = low + (high - low) * values
    return np.where(np.abs(found - 1) <= NEUTRAL, 1.0, found)


def carried(factors: F64, gaussians: Gaussians, strokes: Gaussians) -> F64:
    """Factors [k] of strokes: the mean over the Gaussians nearest to each, weighted by painted area.

    A stroke that is nearest to no Gaussian takes the factor of the Gaussian nearest to it.

    Args:
        factors: [N] of the Gaussians.
        gaussians: N >= 1 Gaussians that the strokes were made of.
        strokes: k strokes.
    """
    if len(strokes) == 0:
        return np.ones(0)
    points = np.ascontiguousarray(gaussians.means, np.float32)
    nearest = assign(points, strokes.means.astype(np.float64))[1]
    weights = np.maximum(painted_areas(gaussians), np.finfo(np.float64).tiny)
    mass = np.bincount(nearest, weights, len(strokes))
    # of differences from 1, so that the mean of ones is exactly 1
    sums = np.bincount(nearest, weights * (factors - 1), len(strokes))
    found, is_alone = np.ones(len(strokes)), mass == 0
    found[~is_alone] += sums[~is_alone] / mass[~is_alone]
    if is_alone.any():
        places = np.ascontiguousarray(strokes.means[is_alone], np.float32)
        found[is_alone] = factors[assign(places, gaussians.means.astype(np.float64))[1]]
    return found


def apply_factors(strokes: Gaussians, name: str, factors: F64) -> Gaussians:
    """Strokes with a property multiplied; those with a factor of 1 keep their bits.

    Args:
        strokes: k strokes.
        name: "size", "opacity" or "chroma" (OKLab, of the view-independent color).
        factors: [k] >= 0; for opacities at most 1.
    """
    dtype = strokes.means.dtype
    if name == "size":
        return replace(strokes, scales=strokes.scales * factors[:, None].astype(dtype))
    if name == "opacity":
        return replace(strokes, opacities=strokes.opacities * factors.astype(dtype))
    assert name == "chroma", "density is a matter of clustering"
    rgb = base_colors(strokes.sh)
    lab = oklab_of(rgb)
    lab[:, 1:] *= factors[:, None]
    is_same = (factors == 1)[:, None]
    steps = np.where(is_same, 0.0, np.clip(rgb_of_oklab(lab), 0, 1) - rgb)
    changed = shift_base_colors(strokes, steps)
    return replace(changed, sh=np.where(is_same[:, None], strokes.sh, changed.sh))
