"""Maps on the ground: the shadow of a subject, its contact with the ground, and reflected color.

The shadow is the density of paint above the ground, projected along the lamp, in layers of height: the higher
a layer, the softer its edge. A point above the ground has the shade at its projection along the lamp.
"""

from dataclasses import dataclass

import numpy as np

from brushgs.core.native import core as _core
from brushgs.passes.add.stage_place import Place
from brushgs.values.arrays import F64
from brushgs.values.colors import oklab_of
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors

SIDE: int = _core.SHADOW_SIDE  # cells of a map
REACH: float = _core.SHADOW_REACH  # half its side, in radii of the subject


@dataclass(frozen=True, eq=False)
class Shadow:
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
        place, points = self.place, np.ascontiguousarray(points)
        maps = self.shade, self.contact, self.reflected
        return np.asarray(_core.shadow_at(*maps, place.radius, place.lamp.tolist(), points)).reshape(-1, 4)


def cast_shadow(gaussians: Gaussians, place: Place, weights: F64) -> Shadow:
    """The maps of a subject.

    Args:
        gaussians: N; those above the ground count.
        place: where they stand.
        weights: [N] the paint of each; 0 for those without a shadow, such as the ground itself.
    """
    points = np.ascontiguousarray(place.local(gaussians.means))
    lab = oklab_of(base_colors(gaussians.sh[:, :1]).astype(np.float64))
    weights = np.ascontiguousarray(weights, np.float64)
    shade, contact, reflected = _core.cast_shadow(
        points, weights, np.ascontiguousarray(lab), place.radius, place.lamp.tolist()
    )
    square = (SIDE, SIDE)
    return Shadow(place, shade.reshape(square), contact.reshape(square), reflected.reshape(2, *square))
