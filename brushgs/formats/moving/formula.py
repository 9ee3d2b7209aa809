"""Check the rows of formats that store formulas of time, and make a moving scene of them.

Readers return raw rows (`RawRows`); `clip_of` makes the moving scene. See `brushgs.values.formula`.
"""

from dataclasses import dataclass, replace
from math import nextafter
from typing import Any

import numpy as np

from brushgs.formats.scenes.columns import Columns, Faults, drop_zero_bands, find_faults
from brushgs.formats.scenes.open_file import join_notes
from brushgs.formats.scenes.rows import RowSource, SceneFile
from brushgs.options.choices import CLIP_FPS
from brushgs.values.arrays import F32, F64, Mask
from brushgs.values.formula import Formula, reach
from brushgs.values.gaussians import SH_TERMS
from brushgs.values.moving import MovingScene

_LARGEST = float(np.finfo(np.float32).max)
NOMINAL_RATE = CLIP_FPS  # moments per second, if a format does not state it
NOMINAL_FRAMES = 50  # from time 0 to 1, if a format does not state it: SpaceTimeGaussian trains 50 at once
NOMINAL_DURATION = NOMINAL_FRAMES / NOMINAL_RATE  # seconds


@dataclass(frozen=True)
class RawRows:
    """All rows of a file, not yet checked."""

    columns: Columns  # with log-scales, and logits or opacities
    stored: dict[str, F32]  # name of each column of the formula -> its stored values, which must be finite
    centers: F32  # [N] see `Formula`
    widths: F64  # [N] see `Formula`; a row with NaN is dropped
    width_name: str  # name of the column of widths, for messages
    motion: F32  # [N, p, 3] see `Formula`
    spin: F32 | None = None  # [N, 4] see `Formula`
    # [N, 3] world units, if the file stores them linearly: a logarithm would lose digits
    scales: F32 | None = None
    is_logit: bool = True  # whether opacities are logits
    windows: F64 | None = None  # [N, 2] see `Formula`

    def faults(self, clock: tuple[float, float]) -> Faults:
        """Rows whose formula cannot be computed, or exceeds float32 at some time of the clock."""
        yield from ((name, values, ~np.isfinite(values)) for name, values in self.stored.items())
        yield self.width_name, self.widths, np.isnan(self.widths)
        most = reach(self.centers.astype(np.float64), *clock)[:, None]
        powers = np.arange(1, self.motion.shape[1] + 1)
        farthest = np.abs(self.columns.means) + np.einsum("npc,np->nc", np.abs(self.motion), most**powers)
        for index, name in enumerate("xyz"):
            yield f"{name} over time", farthest[:, index], ~(farthest[:, index] < _LARGEST)
        if self.spin is not None:
            largest = (np.abs(self.columns.quats) + np.abs(self.spin) * most).max(axis=1)
            yield "rotation over time", largest, ~(largest < _LARGEST)

    def take(self, keep: Mask) -> "RawRows":
        """The rows where a mask is True; `columns` is compacted in place."""
        self.columns.move(keep, 0)
        names = ("centers", "widths", "motion", "spin", "scales", "windows")
        found = {name: getattr(self, name) for name in names}
        kept: dict[str, Any] = {name: column[keep] for name, column in found.items() if column is not None}
        return replace(self, columns=self.columns.part(0, int(np.count_nonzero(keep))), stored={}, **kept)


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
    """The moving scene of a file of formulas. A SceneWarning reports rows that were dropped.

    Args:
        file: header of the file.
        rows: its rows; overwritten.
        duration: seconds.
        clock: value of the time variable of the formulas at the start and at the end.
        is_open: whether the end is excluded, because windows end there; it is then sampled just before.
        cutoff: see `Formula`.
        is_timed: whether the duration comes from the file.

    Raises:
        SceneError: if no row can be drawn.
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


def open_nothing() -> RowSource:
    """Placeholder for `open_rows` of files that have no still rows."""
    raise AssertionError("a moving scene is read as a whole")
