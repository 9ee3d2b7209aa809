"""A moment between two that a file holds."""

from dataclasses import replace

import numpy as np

from brushgs.values.arrays import F32, Array
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import normalized


def between(first: Gaussians, second: Gaussians, share: float) -> Gaussians:
    """The Gaussians at a share of the way from one moment to another, whose rows correspond.

    Centres, scales, opacities and colours lie on a straight line, rotations on the shorter arc (as normalised
    linear mixtures of quaternions). Brushes are those of the first.

    Args:
        first: N Gaussians.
        second: the same N Gaussians, later.
        share: 0 is the first, 1 the second.
    """
    num_terms = max(first.sh.shape[1], second.sh.shape[1])
    second_quats = normalized(second.quats)
    first_quats = normalized(first.quats)
    second_quats *= np.where(np.sum(first_quats * second_quats, axis=1) < 0, -1.0, 1.0)[:, None]
    return replace(
        first,
        means=_line(first.means, second.means, share),
        quats=_line(first_quats, second_quats, share),
        scales=_line(first.scales, second.scales, share),
        opacities=_line(first.opacities, second.opacities, share),
        sh=_line(_padded(first.sh, num_terms), _padded(second.sh, num_terms), share),
    )


def _line(first: Array, second: Array, share: float) -> F32:
    return ((1 - share) * first + share * second).astype(np.float32, copy=False)


def _padded(sh: Array, num_terms: int) -> Array:
    """Colours with as many terms as the other moment has; those above the degree of a file are zero."""
    missing = num_terms - sh.shape[1]
    return np.pad(sh, ((0, 0), (0, missing), (0, 0))) if missing else sh
