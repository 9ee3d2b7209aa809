"""The planes and neighbors of strokes, as the core keeps them to turn strokes along the form."""

from dataclasses import replace

import numpy as np

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.passes.color.color_space import XYZ_OVER_WHITE
from brushgs.values.arrays import F64, Array
from brushgs.values.gaussians import Gaussians


class Neighborhood:
    """n strokes and the nearest others of each, which count more with the same plane and color."""

    def __init__(self, strokes: Gaussians) -> None:
        columns = _columns(strokes, "means", "quats", "scales", "sh")
        threads = num_threads_or_default(None)
        self._form = _core.form_of(**columns, xyz_over_white=XYZ_OVER_WHITE, num_threads=threads)
        self._strokes = strokes

    def smoothed(self, values: F64) -> F64:
        """Columns [n, c], repeatedly averaged with the mean of the neighbors."""
        smooth = np.array(values, np.float64, order="C")
        _core.smooth(self._form, smooth)
        return smooth

    def agreed(self, directions: F64) -> F64:
        """Directions [n, 3], flipped to agree with their neighbors."""
        flipped = np.array(directions, np.float64, order="C")
        _core.agree(self._form, flipped)
        return flipped

    def field(self, gaussians: Gaussians, *, by_color_alone: bool) -> tuple[F64, F64]:
        """Directions before smoothing: pairs [n, 2] and weights [n], by the Gaussians of the strokes."""
        pairs, weights = np.empty((len(self._strokes), 2)), np.empty(len(self._strokes))
        _core.form_field(
            self._form,
            **_columns(gaussians, "means", "scales", "opacities", "sh"),
            xyz_over_white=XYZ_OVER_WHITE,
            by_color_alone=by_color_alone,
            pairs=pairs,
            weights=weights,
        )
        return pairs, weights

    def turned(self, pairs: F64, weights: F64, **requested: F64) -> Gaussians:
        """The strokes along smoothed directions.

        Args:
            pairs: [n, 2] as those of `field`.
            weights: [n] likewise.
            requested: `say`, `aspects`, `marked`, `headings`: of the user, see stroke_form.hpp; all or none.
        """
        quats, scales = (
            np.empty((len(self._strokes), width), self._strokes.scales.dtype) for width in (4, 3)
        )
        _core.turn_strokes(
            self._form,
            pairs=pairs,
            weights=weights,
            **requested,
            quats=np.ascontiguousarray(self._strokes.quats),
            turned_quats=quats,
            turned_scales=scales,
        )
        return replace(self._strokes, quats=quats, scales=scales)


def _columns(gaussians: Gaussians, *names: str) -> dict[str, Array]:
    return {name: np.ascontiguousarray(getattr(gaussians, name)) for name in names}
