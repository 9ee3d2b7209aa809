"""Painted masks of a scene select Gaussians: those in white pixels.

Each Gaussian takes the mean of the masks over its pixels, by blending weight. Trust depends on visibility;
hardly visible Gaussians take the value of their neighbors on the same surface, see `settle`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from brushgs.brushes.texture import StrokeTexture
from brushgs.passes.color.picture_votes import votes
from brushgs.passes.neighbours import nearest
from brushgs.rendering.options import RenderOptions, project_with
from brushgs.values.arrays import F64, Array
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices
from brushgs.values.sh import base_colors

# Exponent of the visible share of a Gaussian over all views. With exponent 1, the table under the cloth is
# taken for cloth: IoU of 0.80 instead of 0.94.
TRUST_POWER = 2.0


@dataclass(frozen=True, eq=False)
class MaskView:
    """One painted mask.

    Attributes:
        camera: of the picture.
        inside: [H, W] 0 (outside) to 1.
        known: [H, W] 0 to 1: weight of each pixel.
    """

    camera: Camera
    inside: Array
    known: Array


def mask_votes(gaussians: Gaussians, views: Sequence[MaskView], *, num_threads: int | None = None) -> F64:
    """[N] votes of the masks for each Gaussian, 0 to 1; 1/2 if no view shows any.

    Args:
        gaussians: N Gaussians.
        views: at least one.
        num_threads: None takes the processors available to this process. The result does not depend on it.
    """
    sums, weights, areas = (np.zeros(len(gaussians)) for _ in range(3))
    for view in views:  # one after another: masks of a whole capture would take much memory as float64
        found, shares = votes(
            gaussians,
            [view.camera],
            [view.inside[..., None]],
            pixel_weights=[view.known],
            num_threads=num_threads,
        )
        sums += found[:, 0]
        weights += shares
        areas += np.where(shares > 0, *_areas(gaussians, view))
    is_seen = weights > 0
    means = np.full(len(gaussians), 0.5)
    means[is_seen] = np.clip(sums[is_seen] / weights[is_seen], 0, 1)
    clear = np.zeros(len(gaussians))
    clear[is_seen] = weights[is_seen] / np.maximum(areas, weights)[is_seen]
    return settle(gaussians, means, clear**TRUST_POWER)


def _areas(gaussians: Gaussians, view: MaskView) -> tuple[F64, F64]:
    """[N] area of each Gaussian in a view without occlusion, pixels.

    First the full area; then the area times the weight at its center, for invisible Gaussians: they may be
    hidden, or the mask has no weight there.
    """
    camera = view.camera
    kernel = StrokeTexture.open("gaussian")
    options = RenderOptions.of(kernel)
    boxes, _ = project_with(replace(gaussians, sh=gaussians.sh[:, :1]), camera, options)
    areas, extents = np.zeros(len(gaussians)), boxes.half_extents.astype(np.float64) / kernel.num_sigmas
    columns, rows = np.floor(boxes.centers.astype(np.float64)).astype(np.intp).T
    is_inside = (columns >= 0) & (columns < camera.width) & (rows >= 0) & (rows < camera.height)
    known = np.zeros(len(boxes))
    known[is_inside] = view.known[rows[is_inside], columns[is_inside]]
    areas[boxes.ids] = 2 * np.pi * boxes.opacities * extents[:, 0] * extents[:, 1]
    says = np.zeros(len(gaussians))
    says[boxes.ids] = known
    return areas, areas * says


# Spread values of some Gaussians to all: neighbors of one surface and one color agree.
#
# Masks say little about hidden Gaussians. If a table shows through the cloth on it, it is slightly visible in
# pixels of the cloth; the rest of the table is more reliable. So values minimize
#
#     sum over i of trust_i d_i (x_i - value_i)^2 + SMOOTH / 2 x sum over neighbors of w_ij (x_i - x_j)^2
#
# where w decreases with the distance in standard deviations of both, and with the difference of color, and
# d_i is the sum of the w of a Gaussian: a random walk from each to trusted values. Source: Grady 2006, Random
# Walks for Image Segmentation (with trusted values in place of seeds).


NUM_NEIGHBOURS = 10
NEAR = 1.5  # standard deviations of both together: deviation of the normal distribution of weights
SAME_COLOR = 0.05  # likewise, Euclidean in display-encoded RGB; 0.08 lowers the IoU of the cloth by 0.02
THINNEST = 0.1  # minimum thickness, of a Gaussian's largest scale, so that curved surfaces are linked
LEAST = 1e-6  # weight: no Gaussian is without links
SMOOTH = 0.1  # at 1 the bowl takes the value of its content
TOLERANCE, MOST_STEPS = 1e-5, 300  # of conjugate gradients
_ROWS_AT_A_TIME = 1 << 16  # limits the memory for neighbors to some 100 MB


def settle(gaussians: Gaussians, values: F64, trust: F64) -> F64:
    """Values with agreement between neighbors of one surface.

    Args:
        gaussians: N Gaussians.
        values: [N].
        trust: [N] >= 0, 1 where a value counts ten times as much as all neighbors together.

    Returns:
        [N] between the least and the highest value. Does not depend on the unit of the scene.
    """
    num = len(gaussians)
    if num < 2:
        return values
    from scipy.sparse import diags
    from scipy.sparse.linalg import cg

    links = _links(gaussians)
    degrees = np.asarray(links.sum(axis=1)).ravel()
    known = (trust + LEAST) * degrees
    system = diags(SMOOTH * degrees + known) - SMOOTH * links
    own = diags(1 / (SMOOTH * degrees + known))
    middle = 0.5 * (values.min() + values.max())  # symmetric: the opposite values give the opposite result
    centred = values - middle
    found, _ = cg(system, known * centred, x0=centred, rtol=TOLERANCE, maxiter=MOST_STEPS, M=own)
    return np.asarray(np.clip(middle + found, values.min(), values.max()))


def _links(gaussians: Gaussians):  # type: ignore[no-untyped-def]  # scipy.sparse has no types
    """Sparse symmetric [N, N] weights of neighbors."""
    from scipy.sparse import coo_matrix

    num = len(gaussians)
    count = min(NUM_NEIGHBOURS, num - 1)
    _, near = nearest(gaussians.means, gaussians.means, count + 1)
    near = near[:, 1:]
    scales = gaussians.scales.astype(np.float64)
    largest = float(scales.max())
    unit = largest if largest > 0 else 1.0  # squares of tiny and huge scales stay in range
    scales = np.maximum(scales / unit, np.maximum(THINNEST * scales.max(axis=1, keepdims=True) / unit, 1e-9))
    axes = rotation_matrices(gaussians.quats).astype(np.float64) * scales[:, None]
    covars = axes @ axes.transpose(0, 2, 1)
    colors = base_colors(gaussians.sh)
    weights = np.empty((num, count))
    for first in range(0, num, _ROWS_AT_A_TIME):
        rows = slice(first, first + _ROWS_AT_A_TIME)
        others = near[rows]
        steps = (gaussians.means[others].astype(np.float64) - gaussians.means[rows][:, None]) / unit
        both = covars[others] + covars[rows][:, None]
        gaps = (steps * np.linalg.solve(both, steps[..., None])[..., 0]).sum(axis=2)
        shifts = ((colors[others] - colors[rows][:, None]) ** 2).sum(axis=2)
        with np.errstate(under="ignore"):
            weights[rows] = np.exp(-gaps / (2 * NEAR**2) - shifts / (2 * SAME_COLOR**2)) + LEAST
    own = np.repeat(np.arange(num), count)
    links = coo_matrix((weights.ravel(), (own, near.ravel())), shape=(num, num)).tocsr()
    return links.maximum(links.T)
