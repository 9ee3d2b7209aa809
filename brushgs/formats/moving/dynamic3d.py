"""The params.npz of Dynamic3DGaussians: centres, rotations and colours of every moment, in one archive.

Sizes and opacities are of all moments, and colours may be. Colours are RGB, 0 to 1, without view dependence.
Moments follow each other at 1/30 s, as in the captures that it was made for. Files of SplaTAM have the same
names, and one moment. Source: Luiten et al. 2024, Dynamic 3D Gaussians; helpers.py, `save_params`.
"""

from pathlib import Path

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.moving.clip import NOMINAL_RATE
from brushgs.formats.moving.kept_moments import Moments
from brushgs.formats.moving.kept_rows import Kept, keep_rows
from brushgs.formats.moving.npz import StoredArray, open_npz
from brushgs.formats.scenes.columns import Columns
from brushgs.formats.scenes.encoding import STANDARD
from brushgs.values.arrays import F32
from brushgs.values.gaussians import Gaussians
from brushgs.values.moving import MovingScene
from brushgs.values.notes import LoadNotes
from brushgs.values.sh import C0

_WIDTHS = {
    "means3D": (3,),
    "unnorm_rotations": (4,),
    "log_scales": (3, 1),  # one of round Gaussians
    "logit_opacities": (1,),
    "rgb_colors": (3,),
}
# What else the trainers write: segmentation, and cameras.
_KNOWN = {
    *("seg_colors", "cam_m", "cam_c", "cam_unnorm_rots", "cam_trans", "timestep", "intrinsics", "w2c"),
    *("org_width", "org_height", "gt_w2c_all_frames", "keyframe_time_indices"),
}


class Params:
    """An open params.npz."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._arrays, others = open_npz(path, _WIDTHS)
        self.num_rows = self._check_shapes()
        self.num_moments = max(self._count(array) or 1 for array in self._arrays.values())
        self.others = tuple(name for name in others if name not in _KNOWN)
        self._moments = Moments(self._read)
        self._has_told = False

    def sample(self, time: float) -> Gaussians:
        """The Gaussians of one moment, or of one between two."""
        position = min(time * NOMINAL_RATE, self.num_moments - 1)
        nearest = round(position)
        return self._moments.at(nearest if abs(position - nearest) < 1e-6 else position)

    def _check_shapes(self) -> int:
        """The number of Gaussians.

        Raises:
            SceneError: if shapes do not fit each other.
        """
        means = self._arrays["means3D"]
        num_rows = means.shape[-2] if len(means.shape) in (2, 3) else 0
        count = self._count(means) if len(means.shape) == 3 else 1
        for name, widths in _WIDTHS.items():
            shape = self._arrays[name].shape
            rest = shape[-2:] if len(shape) in (2, 3) else ()
            is_in_time = len(shape) < 3 or shape[0] in (1, count)
            if rest not in [(num_rows, width) for width in widths] or not is_in_time:
                times = f"[{count}, {num_rows}, {widths[0]}] or [{num_rows}, {widths[0]}]"
                fact = f"its array {name!r} must have the shape {times}, as means3D says, got {list(shape)}"
                raise SceneError(self.path, f"{fact[:200]}; save it again")
        if num_rows == 0 or not count:
            raise SceneError(self.path, f"holds no Gaussians: means3D is {list(means.shape)}; train it again")
        return num_rows

    @staticmethod
    def _count(array: StoredArray) -> int | None:
        """Moments of an array; None for one of all moments."""
        return array.shape[0] if len(array.shape) == 3 else None

    def _read(self, index: int) -> Kept:
        """One moment."""
        columns = Columns.empty(self.num_rows, 1)
        columns.means[:] = self._column("means3D", index)
        columns.quats[:] = self._column("unnorm_rotations", index)
        columns.scales[:] = self._column("log_scales", index)
        columns.opacities[:] = self._column("logit_opacities", index)[:, 0]
        with np.errstate(over="ignore"):  # infinity is found below
            columns.sh[:, 0] = (self._column("rgb_colors", index) - 0.5) / C0
        kept, dropped = keep_rows(columns, STANDARD, antialiased=False)
        if dropped.num_rows and (not self._has_told or dropped.num_rows == self.num_rows):
            dropped.report(self.path, self.num_rows)
            self._has_told = True
        return kept

    def _column(self, name: str, index: int) -> F32:
        array = self._arrays[name]
        count = self._count(array)
        return array.read(None if count is None else min(index, count - 1))

    def __reduce__(self) -> tuple[object, ...]:
        """For pickle, since scenes cross processes: a temporary file does not."""
        return type(self), (self.path,)


def open_moving(path: Path) -> MovingScene:
    """Open a params.npz.

    Raises:
        SceneError: if it is damaged, or arrays are missing or do not fit each other.
    """
    params = Params(path)
    count = params.num_moments
    notes = LoadNotes(
        format=f"Dynamic3DGaussians, {count:,} moment{'s' * (count > 1)}",
        rows_read=params.num_rows,
        rows_dropped=0,
        sh_degree_stored=0,
        sh_degree_used=0,
        up=None,
        unknown=params.others,
    )
    times = np.arange(count) / NOMINAL_RATE
    resting = np.ones(params.num_rows, bool) if count == 1 else None
    return MovingScene(float(times[-1]), True, params.sample, times=times, resting=resting, notes=notes)
