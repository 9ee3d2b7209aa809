"""What files of formulas have in common: raw rows are checked, and become a moving scene."""

from dataclasses import dataclass, replace
from math import nextafter

import numpy as np

from brushgs.formats.moving.formula import Formula, path_faults
from brushgs.formats.scenes.columns import Columns
from brushgs.formats.scenes.dropped import Dropped, Faults, find_faults
from brushgs.formats.scenes.encoding import Encoding
from brushgs.formats.scenes.notes import join_notes
from brushgs.formats.scenes.scene_file import SceneFile
from brushgs.formats.scenes.used_terms import drop_zero_bands
from brushgs.options.choices import CLIP_FPS
from brushgs.values.arrays import F32, F64, Mask
from brushgs.values.gaussians import SH_TERMS
from brushgs.values.moving import MovingScene

NOMINAL_RATE = CLIP_FPS  # moments a second where a format does not say
NOMINAL_FRAMES = 50  # from time 0 to 1, where a format does not say: SpaceTimeGaussian trains so many at once
NOMINAL_DURATION = NOMINAL_FRAMES / NOMINAL_RATE  # seconds


@dataclass(frozen=True)
class RawRows:
    """All rows of a file, not yet checked.

    Attributes:
        columns: log-scales, and logits or opacities.
        stored: name of each column of the formula -> its values as stored: all must be finite.
        centers: [N] see `Formula`.
        widths: [N] see `Formula`; NaN is a fault of the row.
        width_name: of the column of widths.
        motion: [N, p, 3] see `Formula`.
        spin: [N, 4] see `Formula`.
        scales: [N, 3] world units, where the file holds them as such: a logarithm would lose digits.
        is_logit: whether opacities are logits.
        windows: [N, 2] see `Formula`.
    """

    columns: Columns
    stored: dict[str, F32]
    centers: F32
    widths: F64
    width_name: str
    motion: F32
    spin: F32 | None = None
    scales: F32 | None = None
    is_logit: bool = True
    windows: F64 | None = None

    def faults(self, clock: tuple[float, float]) -> Faults:
        """Rows whose formula cannot be computed."""
        yield from ((name, values, ~np.isfinite(values)) for name, values in self.stored.items())
        yield self.width_name, self.widths, np.isnan(self.widths)
        columns = self.columns
        centers = self.centers.astype(np.float64)
        yield from path_faults(columns.means, columns.quats, centers, self.motion, self.spin, clock)

    def take(self, keep: Mask) -> "RawRows":
        """The rows of a mask; the columns are moved in place."""
        self.columns.move(keep, 0)
        return RawRows(
            self.columns.part(0, int(np.count_nonzero(keep))),
            {},
            self.centers[keep],
            self.widths[keep],
            self.width_name,
            self.motion[keep],
            None if self.spin is None else self.spin[keep],
            None if self.scales is None else self.scales[keep],
            self.is_logit,
            None if self.windows is None else self.windows[keep],
        )


def clip_of(
    file: SceneFile,
    rows: RawRows,
    *,
    duration: float = NOMINAL_DURATION,
    clock: tuple[float, float] = (0.0, 1.0),
    is_open: bool = False,
    cutoff: float = 0.0,
    is_timed: bool = False,
) -> MovingScene:
    """The moving scene of a file of formulas.

    Args:
        file: what its header states.
        rows: its rows; overwritten.
        duration: seconds.
        clock: what the clock of the formulas shows at the beginning and at the end.
        is_open: whether the last moment is the one just before the end, where windows end.
        cutoff: see `Formula`.
        is_timed: whether the seconds come from the file.

    Raises:
        SceneError: if no row of it can be drawn; a SceneWarning says of rows that were dropped.
    """
    keep, dropped = find_faults(rows.columns, 0, file.num_terms - 1, rows.faults(clock))
    dropped.report(file.path, file.num_rows)
    rows = rows if keep is None else rows.take(keep)
    columns = rows.columns
    columns.activate(is_logit=rows.is_logit)
    if rows.scales is not None:
        columns.scales = rows.scales
    drop_zero_bands(columns)
    still = columns.gaussians(antialiased=file.training == "antialiased")
    centers = rows.centers.astype(np.float64)
    formula = Formula(still, centers, rows.widths, rows.motion, rows.spin, rows.windows, cutoff)
    degree = SH_TERMS[columns.sh.shape[1]]
    notes = join_notes([file], rows_dropped=dropped.num_rows, sh_degree_used=degree)
    start, end = clock
    rate = (end - start) / duration if duration else 0.0
    last = (nextafter(end, start) if is_open else end) if duration else start
    return MovingScene(
        duration,
        True,
        lambda time: formula.at(min(start + rate * time, last)),
        resting=formula.resting(start, last),
        notes=replace(notes, is_timed=is_timed),
    )


def read_nothing(*, encoding: Encoding, is_raw: bool) -> tuple[Columns, Dropped]:
    """A `ColumnReader` for files without rows at rest."""
    raise AssertionError("a moving scene is read as a whole")
