"""From the coats of a painting to a painting that grows, coat after coat."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from brushgs.pipeline.growth.layers import NONE, Layers
from brushgs.pipeline.growth.order import Order, lay_orders
from brushgs.pipeline.make_strokes import StrokeMaker
from brushgs.pipeline.report import Report
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.rendering.growing import GrowingCoat, GrowingPainting
from brushgs.rendering.relief import Relief, median_size
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.passes.reduce.cluster import Grouping

NUM_VIEWS = 4  # of a path, in which strokes are seen or hidden
PACE = 0.15  # exponent of the number of strokes in the duration of a stage: small strokes come faster
# Shares of a duration after which waiting strokes come: of the later coats that mostly cover them; and of all
# coats until one that is tested against them, for strokes that these hide.
COVERED_FROM, HIDDEN_FROM = 0.3, 0.9


def grow(
    painting: Painting,
    strokes: Gaussians,
    grouping: "Grouping | None",
    maker: StrokeMaker,
    finish: Callable[[Gaussians], Gaussians],
    cameras: Sequence[Camera],
    report: Report,
) -> GrowingPainting:
    """Plan how a painting grows.

    Args:
        painting: the finished painting. Coats of these very strokes begin with coarser ones; the strokes of
            other coats come by size alone.
        strokes: of the painting; for these and the next three see `Layers.of`.
        grouping: None if there are no coarser strokes.
        maker: of the strokes.
        finish: of the strokes.
        cameras: the view, or those of a path, of which a few count.
        report: gets the stage.
    """
    with report.stage("order") as stage:
        of_coats = [
            Layers.of(strokes, grouping, maker, finish)
            if grouping is not None and coat.strokes is strokes
            else Layers.flat(coat.strokes)
            for coat in painting.coats
        ]
        orders = lay_orders(painting.coats, of_coats, cameras[:: -(-len(cameras) // NUM_VIEWS)])
        growing, num_laid = _paced(painting.coats, of_coats, orders)
        num_over = sum(len(of_coat.strokes) - of_coat.num_finished for of_coat in of_coats)
        stage.did = f"{num_laid:,} strokes one after the other, {num_over:,} of them painted over"
        stage.counts = {"laid": num_laid, "painted_over": num_over}
    return GrowingPainting(painting, growing)


def _paced(
    coats: Sequence[Coat], layers: Sequence[Layers], orders: Sequence[Order]
) -> tuple[tuple[GrowingCoat, ...], int]:
    """The coats with the times of their strokes, and the number of strokes."""
    counts = np.concatenate([*(order.counts for order in orders), np.zeros(1, np.intp)])
    laid, passed = np.cumsum(counts), np.cumsum(counts**PACE)
    duration = max(float(passed[-1]), 1.0)
    knots = np.concatenate([[0], laid]), np.concatenate([[0], passed]) / duration
    times, comes, before, start = [], [], 0, 0.0
    ends = np.interp(np.cumsum([int(order.counts.sum()) for order in orders]), *knots).tolist()
    for order, end in zip(orders, ends, strict=True):
        time = np.interp(before + order.ranks, *knots)
        before += int(order.counts.sum())
        until = 1.0 if order.complete_with is None else ends[order.complete_with]
        covered = _spread(end + COVERED_FROM * (until - end), until, int(order.is_covered.sum()))
        time[order.is_covered] = covered
        times.append(time)
        hidden = 1.0 if order.complete_with is None else start + HIDDEN_FROM * (until - start)
        comes.append(np.where(order.is_unseen, np.inf, np.where(order.is_hidden, hidden, time)))
        start = end
    in_turn = np.sort(np.concatenate([*comes, np.zeros(0)]))
    num_laid = int(np.isfinite(in_turn).sum())
    growing, at_end = [], num_laid - sum(int((come == 1).sum()) for come in comes)
    for coat, of_coat, time, come in zip(coats, layers, times, comes, strict=True):
        leaves = np.full(len(time), np.inf)
        leaves[of_coat.num_finished :] = 1.0  # if no replacement of a stroke is worth keeping
        replacing = np.flatnonzero(of_coat.parents != NONE)
        leaves[of_coat.parents[replacing]] = time[replacing]
        laid = np.where(np.isfinite(come), np.searchsorted(in_turn, come), np.inf)
        is_last = come == 1
        laid[is_last] = at_end + np.arange(np.count_nonzero(is_last))
        at_end += int(np.count_nonzero(is_last))
        shares = laid / max(num_laid, 1)
        growing.append(GrowingCoat(_with_coarser(coat, of_coat), come, leaves, shares))
    return tuple(growing), num_laid


def _with_coarser(coat: Coat, layers: Layers) -> Coat:
    """The coat with all strokes; the finished ones keep the thickness they have without the others."""
    if layers.strokes is coat.strokes:
        return coat
    options = coat.options
    if options.relief is not None:
        options = replace(options, relief=_of_finished(options.relief, coat.strokes))
    fields = coat.fields
    if fields is not None:
        from brushgs.rendering.canonical import fit_canonical

        earlier = layers.strokes.take(np.arange(len(coat.strokes), len(layers.strokes)))
        fields = fields.followed_by(fit_canonical(earlier, num_threads=options.num_threads))
    return replace(coat, strokes=layers.strokes, options=options, fields=fields)


def _of_finished(relief: Relief, strokes: Gaussians) -> Relief:
    """A fixed relief for all strokes with the heights of these."""
    return replace(relief, size=median_size(strokes)).in_lights_of(strokes)


def _spread(start: float, end: float, count: int) -> F64:
    """`count` evenly spread times from a start to an end."""
    return np.linspace(start, end, count, endpoint=False)
