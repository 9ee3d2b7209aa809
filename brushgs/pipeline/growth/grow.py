"""From the coats of a painting to a painting that grows, coat after coat."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from brushgs.brushes.texture import StrokeTexture
from brushgs.cameras.around import small_view
from brushgs.pipeline.growth.layers import NONE, Layers
from brushgs.pipeline.make_strokes import StrokeMaker
from brushgs.pipeline.report import Report
from brushgs.rendering.areas import seen_areas
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.rendering.growing import GrowingCoat, GrowingPainting
from brushgs.rendering.options import RenderOptions, draw_with
from brushgs.rendering.relief import Relief, median_size
from brushgs.rendering.visibility import painted_sums
from brushgs.values.arrays import F64, Array, Mask, Rows
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors

if TYPE_CHECKING:
    from brushgs.passes.reduce.cluster import Grouping


# The order in which strokes are laid: largest first, then largest reduction of error, lights last.
#
# Strokes that the finished painting hides come at the very end, when they are covered, so no frame shows the
# far side of an object. Errors are measured on small pictures of flat dabs, like those by which clusters were
# cut.


# Visible shares below which a stroke is hidden: of a finished stroke, and of one that is painted over.
# Without strokes visible to less than 3 % koala is within 29 dB of the finished picture, 0.1 % within 39 dB.
HIDDEN, HIDDEN_COARSE = 1e-3, 0.03
COVERED = 0.5  # share of a stroke's visible area in its own coat; later coats leave less
LIGHTS = 0.08  # share of the broods that come last: those that lighten most
LEAST_LIGHT = 0.03  # minimum of that, OKLab L
_LARGEST = ("own", "seen", "sizes")


@dataclass(frozen=True, eq=False)
class Order:
    """When strokes are laid.

    Attributes:
        ranks: [N] number of strokes that are laid before the brood of each stroke.
        is_unseen: [N] coarse strokes that never come, because their level hides them.
        is_hidden: [N] strokes that wait for the end; the stroke that they replace still leaves in its turn.
        is_covered: [N] strokes that wait for later coats, which cover most of them.
        complete_with: the last coat before one that is tested against this one. Until its end this one is
            complete, too: strokes wait no longer than that. None if there is no such coat.
        counts: number of strokes in each stage, without waiting strokes.
    """

    ranks: Rows
    is_unseen: Mask
    is_hidden: Mask
    is_covered: Mask
    complete_with: int | None
    counts: Rows


def lay_orders(coats: Sequence[Coat], layers: Sequence[Layers], cameras: Sequence[Camera]) -> list[Order]:
    """The order of each coat for some views; `layers` are those of the coats."""
    views = [small_view(camera) for camera in cameras]
    orders: list[Order] = []
    passed = [np.ones((view.height, view.width)) for view in views]
    complete_with: int | None = None
    for row in reversed(range(len(coats))):
        coat, of_coat = coats[row], layers[row]
        found = [_measure(of_coat, view, light) for view, light in zip(views, passed, strict=True)]
        order = _lay_order(of_coat, _Measured.in_all(found), row, complete_with, with_lights=not orders)
        orders.append(order)
        complete_with = complete_with if coat.tolerance is None else row - 1
        if coat.blend == "cover" and coat.dry == 0:  # paint below a glaze or in the tooth of paper is visible
            passed = [light * (1 - one.alpha) for light, one in zip(passed, found, strict=True)]
    return orders[::-1]


def _lay_order(
    layers: Layers, found: "_Measured", row: int, complete_with: int | None, *, with_lights: bool
) -> Order:
    """The order of one coat.

    Args:
        layers: of the coat.
        found: its measures.
        row: of the coat in the painting.
        complete_with: see `Order`.
        with_lights: whether the lights come last.
    """
    seen = found.seen
    stages = np.minimum(layers.level_of, layers.num_merged + 1)
    last = int(stages.max(initial=0)) + 1
    is_coarse = np.arange(len(stages)) >= layers.num_finished
    is_hidden = seen < np.where(is_coarse, HIDDEN_COARSE, HIDDEN)
    is_unseen, is_hidden = is_coarse & is_hidden, ~is_coarse & is_hidden
    keys = np.where(layers.level_of == 0, -found.sizes, _turns(layers, is_unseen, found))
    if with_lights:
        stages[_lights(layers, is_coarse)] = last
    order = np.lexsort((layers.broods, keys, layers.level_of, stages))
    is_covered = ~is_hidden & (complete_with != row) & (seen < COVERED * found.own) & (layers.level_of == 0)
    comes = ~(is_unseen | is_hidden | is_covered)[order]
    before = np.cumsum(comes) - comes
    is_next = np.ones(len(order), bool)
    is_next[1:] = np.diff(layers.broods[order]) != 0
    ranks = np.zeros(len(stages), np.intp)
    ranks[order] = before[is_next][np.cumsum(is_next) - 1]
    counts = np.bincount(stages[order], comes, minlength=last + 1).astype(np.intp)
    return Order(ranks, is_unseen, is_hidden, is_covered, complete_with, counts)


@dataclass(frozen=True, eq=False)
class _Measured:
    """Measures of strokes in the pictures of their levels.

    Attributes:
        own: [N] visible share of each stroke in its coat.
        seen: [N] visible share in the painting.
        before: [N] squared error under the stroke in its last level, where it is replaced.
        after: [N] the same in its first level, where it appeared.
        sizes: [N] area, pixels.
        alpha: [H, W] of the finished strokes in the first view.
    """

    own: F64
    seen: F64
    before: F64
    after: F64
    sizes: F64
    alpha: Array

    @classmethod
    def in_all(cls, views: "Sequence[_Measured]") -> "_Measured":
        """The largest shares and areas of all views, and the sums of their errors."""
        most = {name: np.max([getattr(one, name) for one in views], axis=0) for name in _LARGEST}
        sums = {name: np.sum([getattr(one, name) for one in views], axis=0) for name in ("before", "after")}
        return cls(**most, **sums, alpha=views[0].alpha)


def _measure(layers: Layers, camera: Camera, passed: Array) -> _Measured:
    own, seen, before, after, sizes = (np.zeros(len(layers.strokes)) for _ in range(5))
    kernel = StrokeTexture.open("ellipse")
    options = RenderOptions.of(kernel, depth=False)
    finished: Frame | None = None
    for rows in reversed(layers.levels):
        boxes, frame = draw_with(layers.strokes.take(rows), camera, kernel, options)
        finished = finished or frame
        squares = np.square(frame.rgb - finished.rgb).sum(axis=2)
        values = np.stack([squares, np.ones_like(squares), np.zeros_like(squares)], axis=2)
        sums, areas = painted_sums(boxes, kernel, values, passed)
        here, whole = rows[boxes.ids], seen_areas(boxes, camera.width, camera.height)
        is_new, is_coarse = sizes[here] == 0, here >= layers.num_finished
        before[here[is_new]] = sums[is_new, 0]
        after[here] = sums[:, 0]
        shown = is_new | is_coarse  # of a coarse stroke where it appears, of others in the finished painting
        paint = np.maximum(whole * boxes.opacities, 1e-9)
        own[here[shown]], seen[here[shown]] = (sums[:, 1] / paint)[shown], (areas / paint)[shown]
        sizes[here] = np.maximum(whole, 1e-9)
    assert finished is not None, "there is a level"
    return _Measured(own, seen, before, after, sizes, finished.alpha)


def _turns(layers: Layers, is_unseen: Mask, found: _Measured) -> F64:
    """[N] the turn of each stroke's brood within its level, 0 to 1.

    Broods that replace nothing visible lie behind and come first. Then those that reduce the error most; a
    brood that increases it until others come is combined with one that reduces it more.
    """
    is_behind = (layers.parents == NONE) | is_unseen[layers.parents]
    broods, first, places = np.unique(layers.broods, return_index=True, return_inverse=True)
    gains = np.where(is_behind, 0.0, found.before[layers.parents])[first]
    gains -= np.bincount(places, np.where(is_unseen, 0.0, found.after), len(broods))
    turns = np.zeros(len(broods))
    level_of = layers.level_of[first]
    for level in range(1, len(layers.levels)):
        for is_some in (gains > 0, gains <= 0):
            some = np.flatnonzero((level_of == level) & is_some & ~is_behind[first])
            some = some[np.argsort(-np.abs(gains[some]), kind="stable")]
            turns[some] = (np.arange(len(some)) + 0.5) / max(len(some), 1)
    return np.asarray(turns[places])


def _lights(layers: Layers, is_coarse: Mask) -> Mask:
    """Mask of the strokes that come last: they lighten most, and nothing replaces them."""
    lightness = oklab_of(base_colors(layers.strokes.sh))[:, 0]
    has_parent = layers.parents != NONE
    before = np.where(has_parent, lightness[layers.parents], np.median(lightness) if len(lightness) else 0)
    gains = _of_broods(layers.broods, lightness - before, np.maximum)
    is_left = _of_broods(layers.broods, np.where(is_coarse, -1.0, 0.0), np.minimum) == 0
    is_begun = layers.level_of > 0 if len(layers.levels) > 1 else layers.level_of == 0
    chosen = is_left & is_begun
    if not chosen.any():
        return np.asarray(chosen)
    bound = np.quantile(gains[chosen], 1 - LIGHTS)
    return np.asarray(chosen & (gains > max(bound, LEAST_LIGHT)))


def _of_broods(broods: Rows, values: F64, best: np.ufunc) -> F64:
    """For each stroke the best value of its brood."""
    found, places = np.unique(broods, return_inverse=True)
    start = np.inf if best is np.minimum else -np.inf
    of_brood = np.full(len(found), start)
    best.at(of_brood, places, values)
    return np.asarray(of_brood[places])


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
