"""Maps on the ground: the shadow of a subject, its contact with the ground, and reflected color.

The shadow is the density of paint above the ground, projected along the lamp, in layers of height: the higher
a layer, the softer its edge. A point above the ground has the shade at its projection along the lamp.
"""

from typing import NamedTuple

import numpy as np

from brushgs.core.native import core as _core
from brushgs.passes.add.stage_place import Place
from brushgs.values.arrays import F64

SIDE: int = _core.SHADOW_SIDE  # cells of a map
REACH: float = _core.SHADOW_REACH  # half its side, in radii of the subject


class Shadow(NamedTuple):
    """Maps of shadow, contact and reflected color, [SIDE, SIDE] by right and away around the foot.

    Attributes:
        place: of the subject.
        shade: 0 to 1, share of blocked light.
        contact: 0 to 1, nearness of paint above the ground.
        reflected: [2, SIDE, SIDE] OKLab a and b of near objects, times their nearness.
    """

    place: Place
    shade: F64
    contact: F64
    reflected: F64

    def at(self, points: F64) -> F64:
        """[n, 4] shade, contact, and a and b times nearness, at local points [n, 3]."""
        return np.asarray(_core.shadow_at(self, np.ascontiguousarray(points))).reshape(-1, 4)


def cast_shadow(points: F64, weights: F64, lab: F64, place: Place) -> Shadow:
    """The maps of a subject.

    Args:
        points: [N, 3] local; those above the ground count.
        weights: [N] the paint of each; 0 for those without a shadow, such as the ground itself.
        lab: [N, 3] OKLab.
        place: where they stand.
    """
    shade, contact, reflected = _core.cast_shadow(points, weights, lab, place)
    square = (SIDE, SIDE)
    return Shadow(place, shade.reshape(square), contact.reshape(square), reflected.reshape(2, *square))
