"""Estimate the best number of strokes for a scene in a view, without clustering at every count.

The curve of error over cost is sampled at a few counts, each four times the previous. Nested cells
(`halving`) approximate clusters: the strokes of each count are merged from those of the next, painted once,
and compared with the plain picture. Costs are modeled (`view_model`), not timed, so that the count is the
same on every machine.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.brush_set import Brush, Brushes, BrushSet
from brushgs.brushes.texture import StrokeTexture
from brushgs.options.choices import Cost, Features, Filter, Merge
from brushgs.passes.reduce.cluster import cluster_weights
from brushgs.passes.reduce.contribution import visible_shares
from brushgs.passes.reduce.features import cluster_features
from brushgs.passes.reduce.halving import halve
from brushgs.passes.reduce.merge import merge_clusters
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.render import render
from brushgs.stroke_count.curve import ErrorCurve, Knee, knee, psnr_of, value_at
from brushgs.stroke_count.view_model import KERNEL, ViewModel, saves_by_merging
from brushgs.values.arrays import Array, check
from brushgs.values.camera import Camera
from brushgs.values.colors import rgb_of
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0, base_colors, used_sh_degree

WHITE = (1.0, 1.0, 1.0)
FEWEST = 128  # first count of the curve: fewer strokes are a blot
SPACING, FEWEST_SAMPLES = 4, 4  # approximate ratio of sampled counts; smaller for few samples
ROW_STEP = 4  # compare every fourth row of pixels: neighboring rows hardly differ
CELLS = 1.05  # knee of a still by cells over knee by clusters, mean of eight scenes

Rule = Literal["knee", "psnr", "size"]


@dataclass(frozen=True, eq=False)
class Choice:
    """A number of strokes, and its expected error and size.

    Attributes:
        strokes: 1 to N.
        rule: the rule that chose it.
        psnr: dB to the plain picture; for the knee of a still without the error of the brush.
        size: typical length of a stroke, pixels, see `brushgs.stroke_count.view_model.typical_size`.
        knee: gain and cost of doubling there; None for other rules, or if the scene is too small.
        curve: the M sampled counts up to N; its seconds are modeled.
        sizes: [M] pixels, not increasing.
    """

    strokes: int
    rule: Rule
    psnr: float
    size: float
    knee: Knee | None
    curve: ErrorCurve
    sizes: NDArray[np.float64]

    def count_of_size(self, size: float) -> int:
        """The fewest strokes with an expected typical size of at most `size` pixels; N if there are none."""
        return _first_within(self.curve.strokes, self.sizes, size)

    def count_below(self, count: int, decibels: float) -> int:
        """The fewest strokes expected to be worse than `count` strokes by at most `decibels`, >= 0."""
        counts, errors = self.curve.strokes, np.minimum.accumulate(self.curve.rmse)
        return _first_within(counts, errors, value_at(counts, errors, count) * 10 ** (decibels / 20))


def choose_strokes(
    gaussians: Gaussians,
    camera: Camera,
    texture: Brush,
    *,
    psnr: float | None = None,
    size: float | None = None,
    plain: Frame | None = None,
    background: Array | Sequence[float] | str = WHITE,
    filter: Filter = "mip",
    num_sigmas: float | None = None,
    features: Features = "balanced",
    merge: Merge = "cover",
    cost: Cost = "painting",
    num_threads: int | None = None,
) -> Choice:
    """Choose the number of strokes for a scene in a view.

    Without `psnr` and `size` it is the knee of the curve of error over cost, see `curve`. Choosing takes less
    time than one clustering and ten frames. The count does not depend on the number of threads.

    Args:
        gaussians: N Gaussians, pruned as for painting, N >= 1.
        camera: the view, in the size in which pictures are compared.
        texture: the brush, its name or path; see `render`.
        psnr: choose the fewest strokes expected to reach this PSNR to the plain picture instead, dB, > 0.
            Clusters mostly reach the error of the sampled cells at 0.7 to 1.4 times their count.
        size: choose the fewest strokes of at most this typical size instead, pixels, > 0. Below 1,000 strokes
            they are up to 20 % smaller, as clusters are more compact than cells.
        plain: the plain picture; None renders `gaussians` with the "gaussian" kernel.
        background: for comparing pictures, see `Frame.over`.
        filter: see `rasterize`.
        num_sigmas: see `render`.
        features: see `cluster`.
        merge: see `cluster`.
        cost: of the knee: the time of a whole "painting", as for a still, or of a "frame", as for a film.
        num_threads: see `render`.

    Returns:
        The count with its expected error and size. Without a knee each Gaussian is a stroke: for fewer than
        256 Gaussians, and for a still if choosing and merging would take as long as painting all of them
        (below about 19,000).

    Raises:
        ValueError: if there is no Gaussian, both `psnr` and `size` are given, one is not positive, or even
            all N strokes do not reach `psnr`.

    Example:
        >>> choice = bg.choose_strokes(gaussians, camera, "flat", cost="frame")
        >>> choice.strokes < len(gaussians)
        True
    """
    if len(gaussians) == 0:
        raise ValueError("choose_strokes: gaussians must have at least one row, got none")
    if psnr is not None and size is not None:
        raise ValueError("choose_strokes: psnr cannot be combined with size; omit one")
    for name, value in (("psnr", psnr), ("size", size)):
        if value is not None and not 0 < value < np.inf:
            raise ValueError(f"choose_strokes: {name} must be above 0 and finite, got {value:g}")
    brush_set = BrushSet.of(texture)
    options = RenderOptions.of(brush_set, filter=filter, num_sigmas=num_sigmas, num_threads=num_threads)
    view_model = open_view_model(gaussians, camera, brush_set, options, plain=plain, background=background)
    return choose_for_view_model(
        gaussians, view_model, psnr=psnr, size=size, features=features, merge=merge, cost=cost
    )


def open_view_model(
    gaussians: Gaussians,
    camera: Camera,
    texture: Brushes,
    options: RenderOptions,
    *,
    plain: Frame | None = None,
    background: Array | Sequence[float] | str = WHITE,
) -> ViewModel:
    """The model of a view for comparing stroke counts. Arguments as for `choose_strokes`."""
    if plain is None:
        kernel = StrokeTexture.open(KERNEL)
        plain = render(gaussians, camera, kernel, depth=False, num_threads=options.num_threads)
    check("choose_strokes", plain=(plain.alpha, f"{camera.height} {camera.width}"))
    behind = rgb_of(background) if isinstance(background, str) else background
    return ViewModel(camera, texture, options, plain, np.asarray(behind))


def choose_for_view_model(
    gaussians: Gaussians,
    view_model: ViewModel,
    *,
    psnr: float | None = None,
    size: float | None = None,
    features: Features = "balanced",
    merge: Merge = "cover",
    cost: Cost = "painting",
    are_changed: bool = False,
) -> Choice:
    """`choose_strokes` with the plain picture already rendered; takes and raises the same.

    If strokes `are_changed` after clustering, the PSNR of all N is unknown here: no budget is refused, and
    the count is N if the sampled counts do not reach it.
    """
    num = len(gaussians)
    rule = _rule_of(psnr, size)
    # For the knee of a still the error is that of clustering, see `curve`.
    is_still = rule == "knee" and cost == "painting"
    samples, of_error = [], view_model.of_kernel if is_still else view_model
    fewer = [] if is_still and not saves_by_merging(num) else counts_to_sample(num, rule)
    for strokes in _coarser(gaussians, view_model, fewer, features, merge):
        boxes = view_model.boxes(strokes)
        drawn = of_error.boxes(strokes) if is_still else boxes
        samples.append(
            (
                len(strokes),
                of_error.rmse(drawn, ROW_STEP),
                view_model.cost(strokes, boxes, num, cost),
                view_model.size(boxes),
            )
        )
        if psnr is not None and len(strokes) == num and not are_changed:
            check_reach(num, psnr_of(view_model.rmse(boxes)), psnr, view_model.texture.name)
    counts, errors, costs, sizes = (np.array(column) for column in zip(*reversed(samples), strict=True))
    curve, sizes = ErrorCurve(counts, errors, costs, ends_unmerged=is_still), np.minimum.accumulate(sizes)
    bend = None
    if psnr is not None:
        chosen = _first_within(counts, np.minimum.accumulate(errors), 10 ** (-psnr / 20))
    elif size is not None:
        chosen = _first_within(counts, sizes, size)
    elif num < 2 * FEWEST:
        chosen = num
    else:
        bend = knee_by_cells(curve)
        chosen = bend.strokes
    error = value_at(counts, np.minimum.accumulate(errors), chosen)
    expected = psnr_of(error) if bend is None else bend.psnr
    return Choice(chosen, rule, expected, value_at(counts, sizes, chosen), bend, curve, sizes)


def _rule_of(psnr: float | None, size: float | None) -> Rule:
    if psnr is not None:
        return "psnr"
    return "knee" if size is None else "size"


def knee_by_cells(curve: ErrorCurve) -> Knee:
    """The knee of clusters, from a curve of sampled cells."""
    bend = knee(curve)
    if not curve.ends_unmerged or bend.strokes == curve.strokes[-1]:
        return bend
    return replace(bend, strokes=max(FEWEST, round(bend.strokes / CELLS)))


def counts_to_sample(num: int, rule: Rule) -> list[int]:
    """Counts below `num` in a geometric sequence, ascending from 1; for the knee from `FEWEST`."""
    few = [] if rule == "knee" else [count for count in (1, 2, 8, 32) if count < min(num, FEWEST)]
    if num < 2 * FEWEST:
        return few
    samples = max(FEWEST_SAMPLES, round(float(np.log(num / FEWEST) / np.log(SPACING))))
    return few + [round(FEWEST * (num / FEWEST) ** (sample / samples)) for sample in range(samples)]


def _coarser(
    gaussians: Gaussians, view_model: ViewModel, counts: list[int], features: Features, merge: Merge
) -> Iterator[Gaussians]:
    """Yield all Gaussians, then about as many strokes as each count, from the largest count down."""
    seen = _as_seen(gaussians, view_model)
    yield seen
    if not counts:
        return
    visible = visible_shares(gaussians)
    weights = np.ones(len(gaussians)) if features == "paper" else cluster_weights(gaussians, visible)
    partitions = halve(cluster_features(gaussians, features), weights, counts)
    strokes = merge_clusters(seen, partitions[-1], merge=merge, visible=visible)
    yield strokes
    for finer, labels in zip(partitions[:0:-1], partitions[-2::-1], strict=True):
        if labels.max() == finer.max():  # fewer distinct points than both counts
            continue
        _, firsts = np.unique(finer, return_index=True)
        strokes = merge_clusters(strokes, labels[firsts], merge=merge)
        yield strokes


def _as_seen(gaussians: Gaussians, view_model: ViewModel) -> Gaussians:
    """The Gaussians in the colors of this view: merging SH degree 0 is faster."""
    if used_sh_degree(gaussians) == 0:
        return gaussians
    boxes = view_model.boxes(gaussians)
    colors = base_colors(gaussians.sh)
    colors[boxes.ids] = boxes.colors
    return replace(gaussians, sh=((colors - 0.5) / C0)[:, None].astype(gaussians.sh.dtype))


def check_reach(num: int, reached: float, asked: float, stroke: str) -> None:
    """Check that all N strokes meet an error budget.

    Raises:
        ValueError: if they do not.
    """
    if reached < asked:
        raise ValueError(
            f"strokes: the error budget must be one that {stroke!r} can meet, got {asked:g} dB; all {num:,} "
            f"strokes reach {reached:.1f} dB; lower the budget or use another stroke"
        )


def _first_within(counts: Array, values: Array, limit: float) -> int:
    """The fewest strokes with descending values of at most `limit`; all if there are none.

    Between two sampled counts the value is interpolated as a power of the count.
    """
    is_within = values <= limit
    if not is_within.any():
        return int(counts[-1])
    at = int(np.argmax(is_within))
    if at == 0 or values[at] == 0:
        return int(counts[at])
    high, low = np.log(values[at - 1]), np.log(values[at])
    share = (high - np.log(limit)) / (high - low)
    first, last = np.log(counts[at - 1]), np.log(counts[at])
    return int(np.clip(np.ceil(np.exp(first + share * (last - first)) - 1e-9), counts[at - 1], counts[at]))
