"""Painted pictures of a scene say which Gaussians are meant: those that paint what is white in them.

Each Gaussian takes the mean of the masks over the pixels that it makes up, by how much of each. What no view
shows is as its nearest neighbours that are seen.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from brushgs.arrays import F64, Array
from brushgs.passes.neighbours import nearest
from brushgs.passes.picture_votes import votes
from brushgs.scene import Camera, Gaussians

LEAST_SEEN = 0.05  # pixels of all views together: of less, neighbours know more
NUM_NEIGHBOURS = 5  # whose votes what is not seen takes


@dataclass(frozen=True, eq=False)
class MaskView:
    """One painted mask.

    Attributes:
        camera: of the picture.
        inside: [H, W] 0 (outside) to 1.
        known: [H, W] 0 to 1: how much each pixel has to say.
    """

    camera: Camera
    inside: Array
    known: Array


def mask_votes(gaussians: Gaussians, views: Sequence[MaskView], *, num_threads: int | None = None) -> F64:
    """[N] the mean of the masks over what each Gaussian shows in them, 0 to 1; 0 where no view shows any.

    Args:
        gaussians: N Gaussians.
        views: at least one.
        num_threads: None takes the processors available to this process. The result does not depend on it.
    """
    sums, weights = np.zeros(len(gaussians)), np.zeros(len(gaussians))
    for view in views:  # one after another: masks of a whole capture need not lie in memory as float64
        found, shares = votes(
            gaussians,
            [view.camera],
            [view.inside[..., None]],
            pixel_weights=[view.known],
            num_threads=num_threads,
        )
        sums += found[:, 0]
        weights += shares
    means = np.clip(sums / np.maximum(weights, np.finfo(np.float64).tiny), 0, 1)
    is_seen = weights >= LEAST_SEEN
    if not is_seen.any():
        return np.zeros(len(gaussians))
    if not is_seen.all():
        count = min(NUM_NEIGHBOURS, int(is_seen.sum()))
        _, rows = nearest(gaussians.means[is_seen], gaussians.means[~is_seen], count)
        means[~is_seen] = means[is_seen][rows].mean(axis=1)
    return means
