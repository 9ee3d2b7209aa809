"""A moving sun over a painting: colors of the strokes under several suns, interpolated.

Strokes keep their positions and brushes. The suns are chosen once for a job, so that a frame painted alone
has the same colors as in the film.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from brushgs.rendering.relief import keep_relief
from brushgs.values.arrays import F32, F64
from brushgs.values.sh import shift_base_colors

if TYPE_CHECKING:
    from brushgs.rendering.canvas import Painting


@dataclass(frozen=True, eq=False)
class Day:
    """The suns of a day, K >= 2.

    Attributes:
        towards: [K, 3] unit vectors toward the sun, world axes, evenly spread over the day; neighbors are
            less than a right angle apart.
        shifts: coat name -> [K, N, 3] RGB added to the strokes' colors under each sun.
    """

    towards: F64
    shifts: Mapping[str, F32]

    def over(self, painting: "Painting", share: float) -> "Painting":
        """The painting at a time of the day.

        Args:
            painting: with coats of these names.
            share: elapsed share of the day, 0 to 1.
        """
        place = min(max(share, 0.0), 1.0) * (len(self.towards) - 1)
        before = min(int(place), len(self.towards) - 2)
        part = place - before

        def between(values: F64 | F32) -> F64:
            return np.asarray((1 - part) * values[before] + part * values[before + 1], np.float64)

        coats = []
        for coat in painting.coats:
            strokes = coat.strokes
            if coat.name in self.shifts:
                strokes = shift_base_colors(strokes, between(self.shifts[coat.name]))
                keep_relief(strokes, coat.strokes)
            coats.append(replace(coat, strokes=strokes))
        lamp = painting.lamp
        if lamp is not None:
            sun = between(self.towards)
            x, y, z = (sun / np.linalg.norm(sun)).tolist()
            lamp = replace(lamp, towards=(x, y, z))
        return replace(painting, coats=tuple(coats), lamp=lamp)
