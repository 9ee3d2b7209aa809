"""The strokes of a coat as columns of numbers for a page: which it shows, and in which order.

Names of columns are camelCase, as in JavaScript; `web/container.js` has the numbers a stroke of each.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.brush_set import BrushSet
from brushgs.outlets.page.fields import field_codes
from brushgs.rendering.border import uniform_of
from brushgs.rendering.streaks import starts_of
from brushgs.values.arrays import F64, Rows
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import used_sh_degree

if TYPE_CHECKING:
    from brushgs.rendering.coat import Coat

MOST_PLAIN = 100_000  # plain Gaussians of a coat: about 3 MB; more is too much for phones


def shown_by(coat: "Coat") -> Gaussians:
    """The strokes of a coat for the page, unsorted: its own, whole or left out, and its plain Gaussians.

    Plain Gaussians have the row of the soft brush; the `MOST_PLAIN` with the most paint are kept.
    """
    if coat.cut is not None:
        shown = np.where(coat.cut.inside, 0, coat.strokes.opacities)
        coat = replace(coat, strokes=replace(coat.strokes, opacities=shown), cut=None)
    if coat.plain is None:
        return coat.strokes
    plain = coat.plain.take(np.sort(coarse_to_fine(coat.plain)[:MOST_PLAIN]))
    rows = np.full(len(plain), len(BrushSet.of(coat.texture)) - 1, np.uint8)
    brushes = coat.strokes.brushes
    own = np.zeros(len(coat.strokes), np.uint8) if brushes is None else brushes
    missing = max(0, plain.sh.shape[1] - coat.strokes.sh.shape[1])  # strokes may have one color each
    sh = np.pad(coat.strokes.sh, ((0, 0), (0, missing), (0, 0)))
    return Gaussians.joined([replace(coat.strokes, sh=sh, brushes=own), replace(plain, brushes=rows)])


def plain_left_out(coat: "Coat") -> Iterator[str]:
    """What `shown_by` leaves out, in words."""
    if coat.plain is not None and len(coat.plain) > MOST_PLAIN:
        yield f"of {len(coat.plain):,} Gaussians that are not painted the page has the {MOST_PLAIN:,} largest"


def coarse_to_fine(strokes: Gaussians) -> Rows:
    """[N] rows by descending paint: area of the two larger axes times opacity, ties by row.

    The first k cover more than any other k in any view, and small strokes only refine: so a share of the
    strokes is a coarser painting. The order of growing paintings (`pipeline/growth/grow.py`) hides gaps
    better, but belongs to one view, and merges strokes for its start.
    """
    larger = np.sort(strokes.scales.astype(np.float64), axis=1)[:, 1:]
    return np.argsort(-larger.prod(axis=1) * strokes.opacities, kind="stable")


def columns_of(
    coat: "Coat", strokes: Gaussians, origin: F64, brush: NDArray[Any] | None
) -> dict[str, NDArray[Any]]:
    """Columns of the strokes of a coat, by name, in page order."""
    options, own = coat.options, len(coat.strokes)
    quats = strokes.quats.astype(np.float64)
    quats /= np.abs(quats).max(axis=1, keepdims=True, initial=0)  # avoids overflow of squares
    quats /= np.linalg.norm(quats, axis=1, keepdims=True)
    ids = np.arange(len(strokes))  # row hashes use the rows of the strokes
    has_regions = strokes.regions is not None and strokes.regions.any()  # a coat without regions lies in none
    reliefs = None if options.relief is None else options.relief.of_strokes(coat.strokes)
    columns: dict[str, NDArray[Any] | None] = {
        "means": strokes.means.astype(np.float64) - origin,
        "quats": quats,
        "scales": strokes.scales,
        "opacities": strokes.opacities,
        "sh": strokes.sh[:, : (used_sh_degree(strokes) + 1) ** 2],
        "brush": brush,
        "region": strokes.regions if has_regions else None,
        "streakStart": starts_of(ids) if options.streaks > 0 else None,
        "relief": None if reliefs is None else np.pad(reliefs, ((0, len(strokes) - own), (0, 0))),
        # 0 stays up to the border
        "chance": np.where(ids < own, uniform_of(ids, 0), 0.0) if coat.border else None,
        "normals": coat.normals,
        "fields": None
        if coat.fields is None
        else np.pad(field_codes(coat.fields, coat.strokes), ((0, len(strokes) - own), (0, 0))),
    }
    if coat.nested is not None:
        columns["gaps"] = coat.nested.gaps
        columns["marks"] = np.stack([coat.nested.spacings, coat.nested.widths], axis=1)
        if not coat.nested.is_round:
            assert coat.chains is not None, "lines have pieces"
            columns["lines"] = np.stack([coat.chains, ids, np.bincount(coat.chains)[coat.chains]], axis=1)
    return {name: values for name, values in columns.items() if values is not None}
