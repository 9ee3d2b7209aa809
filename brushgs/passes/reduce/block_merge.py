"""Merge the blocks of one scene: first each block, then their sums."""

from dataclasses import replace
from typing import NamedTuple

from brushgs.passes.finest import usual_finest
from brushgs.passes.reduce.block_cells import Keys, cell_keys
from brushgs.passes.reduce.block_moments import gaussians_of, moments_of
from brushgs.passes.reduce.block_table import CellTable, sums_by_cell
from brushgs.passes.reduce.contribution import seen_areas
from brushgs.passes.reduce.features import SceneFrame
from brushgs.values.arrays import F64
from brushgs.values.gaussians import Gaussians


class CellSums(NamedTuple):
    """The sums of some rows of a scene by cell: distinct `keys` [n], ascending, and `sums` [F, n]."""

    keys: Keys
    sums: F64


def cell_sums(gaussians: Gaussians, frame: SceneFrame) -> CellSums:
    """The cells of some Gaussians, and the sums in them.

    Args:
        gaussians: any rows of a scene.
        frame: approximate center and radius of the whole scene, see `robust_frame`; the same for all blocks.
    """
    gaussians = replace(gaussians, finest=usual_finest(frame[1]))
    keys = cell_keys(gaussians, seen_areas(gaussians), frame)
    return CellSums(*sums_by_cell(keys, moments_of(gaussians, frame[0])))


def merged_of(table: CellTable, frame: SceneFrame, *, antialiased: bool = False) -> Gaussians:
    """The merged Gaussians of a scene: one per cell.

    They depend on the blocks by rounding only. A Gaussian alone in its cell is unchanged, except for the
    order of its axes.

    Args:
        table: with the `cell_sums` of all rows; empty afterwards.
        frame: of these sums.
        antialiased: whether the scene was trained so.
    """
    finest = 0.0 if antialiased else usual_finest(frame[1])
    return gaussians_of(table.take()[1], frame[0], finest, antialiased=antialiased)
