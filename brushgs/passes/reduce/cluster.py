"""Gaussians -> at most k Gaussians, one per cluster of similar neighbours: the strokes in space.

Three steps, each usable alone: `features.cluster_features` defines similarity, `group` finds the clusters by
k-means, `merge.merge_clusters` makes one Gaussian of each. With views of the scene strokes go where pictures
need them: visible Gaussians weigh most (`seen`), clusters that differ from the pictures are cut (`split`),
and strokes get the colors of the pictures at their positions.
"""

import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.options.choices import Features, Merge, Method
from brushgs.passes.finest import finest_of
from brushgs.passes.form.economy import ECONOMIC_ROUNDS, first_share
from brushgs.passes.reduce.contribution import contributions, seen_areas, visible_shares
from brushgs.passes.reduce.detail import color_detail
from brushgs.passes.reduce.features import cluster_features, spans_of
from brushgs.passes.reduce.lloyd import Clusters, lloyd
from brushgs.passes.reduce.merge import OVERLAP, merge_clusters
from brushgs.passes.reduce.minibatch import minibatch
from brushgs.passes.reduce.morton import morton_order
from brushgs.passes.reduce.pure import keep_pure
from brushgs.passes.reduce.split import FIRST_SHARE, NUM_ROUNDS, Goal, split
from brushgs.passes.seen import Seen, seen_in
from brushgs.rendering.plain import PlainViews
from brushgs.values.arrays import F32, Rows, check
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

MAX_SEED = 2**32 - 1  # of scikit-learn
# Of a focus in weights and errors: clusters on a surface are as dense as the root of the weights. A focus of
# 2 on a sphere in koala, truck and skull gave 1.3 to 1.6 times the strokes per area at 1, 1.9 to 2.5 at 2.
FOCUS_POWER = 1.75
# Clustering methods: points [N, D], weights [N], the number of clusters and a seed in, `Clusters` out. "auto"
# picks one, see `choose_method`. To add one, name it here and in `brushgs.options.choices`, which help reads.
METHODS: dict[str, Callable[..., Clusters]] = {"lloyd": lloyd, "minibatch": minibatch}
# If clusters are split by views afterwards, the start need not converge: 3 to 5 steps instead of 12 change
# three scenes by less than 0.1 dB, either way.
STARTS = METHODS | {"lloyd": partial(lloyd, gain=0.02)}


@dataclass(frozen=True, eq=False)
class Grouping:
    """Clusters of Gaussians, and data on the search.

    Attributes:
        labels: [N] int32, 0 to num_clusters - 1, each in use.
        num_clusters: at most the target.
        method: one of `METHODS`; "none" if there was nothing to group.
        reason: why this method, in words.
        num_steps: Lloyd steps, or passes over the data.
        inertia: sum of weight x squared feature distance to the nearest center.
        num_split: number of clusters that were made by cutting others, see `split`.
        gaussians: the Gaussians, in the colors to merge.
        visible: [N] visibility of each, for the merge; None if not computed.
        parents: one array per round of splitting, in order: for each cluster after the round its cluster
            before.
    """

    labels: NDArray[np.int32]
    num_clusters: int
    method: str
    reason: str
    num_steps: int
    inertia: float
    gaussians: Gaussians
    num_split: int = 0
    visible: NDArray[np.float64] | None = None
    parents: tuple[NDArray[np.intp], ...] = ()

    def merged(self, merge: Merge, into: NDArray[np.integer[Any]] | None = None) -> Gaussians:
        """The strokes: one per cluster, or per group of clusters, `into` [num_clusters]."""
        if self.method == "none":
            return self.gaussians
        labels = self.labels if into is None else into[self.labels]
        return merge_clusters(self.gaussians, labels, merge=merge, visible=self.visible)


def cluster(
    gaussians: Gaussians,
    num_strokes: int,
    *,
    features: Features = "balanced",
    merge: Merge = "cover",
    method: Method = "auto",
    seed: int = 0,
    views: Sequence[Camera] | PlainViews | None = None,
    focus: NDArray[np.float64] | None = None,
) -> Gaussians:
    """Merge Gaussians into fewer and larger ones: `brushgs.cluster` with a count of strokes.

    Args:
        gaussians: N Gaussians.
        num_strokes: k >= 1, maximum number of strokes.
        features: see `brushgs.cluster`, also for the following.
        merge: "cover" or "paper".
        method: "auto", "lloyd" or "minibatch".
        seed: 0 to 2^32 - 1.
        views: guide views, or None.
        focus: [N] > 0, or None.

    Returns:
        At most k Gaussians; the input itself, unmerged, if k >= N.

    Raises:
        TypeError: if `num_strokes` or `seed` is not an integer.
        ValueError: if an option is out of range or unknown, or `focus` or `views` do not match.
    """
    _check_choice("merge", merge, get_args(Merge))
    grouping = group(
        gaussians,
        num_strokes,
        features=features,
        method=method,
        seed=seed,
        views=views,
        focus=focus,
    )
    return grouping.merged(merge)


def group(
    gaussians: Gaussians,
    num_strokes: int,
    *,
    features: Features = "balanced",
    method: Method = "auto",
    seed: int = 0,
    views: Sequence[Camera] | PlainViews | None = None,
    focus: NDArray[np.float64] | None = None,
    worth_keeping: Callable[[Gaussians], NDArray[np.bool_]] | None = None,
    motion: NDArray[np.float32] | None = None,
    economy: float = 0.0,
    cameras: Sequence[Camera] = (),
    seen: Seen | None = None,
) -> Grouping:
    """Find clusters of similar neighbors by k-means. Arguments and errors are those of `cluster`.

    `worth_keeping` is that of `split`: if strokes are not worth keeping, more than `num_strokes` clusters are
    returned. `motion` [N, m] are further features, at most 7, in radii of the scene, to separate Gaussians
    that move differently; None for a still scene. With an `economy` above 0, up to 1, there are few clusters
    at first, which are cut only if the error is visible, see `passes.form.economy`: there may be fewer than
    requested; no effect without views. `cameras` are those of `split`; `seen` is from `seen_in`, if it is
    known. No cluster mixes Gaussians of different `regions`; if there are more regions than requested
    strokes, each region has one.
    """
    num_strokes = _integer("num_strokes", num_strokes, 1, None)
    seed = _integer("seed", seed, 0, MAX_SEED)
    _check_choice("features", features, get_args(Features))
    _check_choice("method", method, ("auto", *METHODS))
    num = len(gaussians)
    if focus is not None:
        check("cluster", means=(gaussians.means, "N 3"), focus=(focus, "N"))
        if not (np.isfinite(focus).all() and focus.min(initial=1) > 0):
            raise ValueError("cluster: focus must be > 0 and finite")
        focus = focus**FOCUS_POWER
    if num_strokes >= num:
        labels, reason = (
            np.arange(num, dtype=np.int32),
            f"{num} Gaussians are not more than {num_strokes} strokes",
        )
        return Grouping(labels, num, "none", reason, 0, 0.0, gaussians)
    chosen, reason = choose_method(num, num_strokes) if method == "auto" else (method, "asked for")
    plain = None if views is None else PlainViews.of(gaussians, views)
    finest = finest_of(gaussians, None if plain is None else plain.cameras)
    gaussians = replace(gaussians, finest=finest)  # the same for all clusters
    seen = seen_in(gaussians, plain) if seen is None and plain is not None else seen
    if plain is not None and seen is not None:
        goal = Goal(plain, num_strokes, focus, worth_keeping, economy, cameras)
        points = _points(seen.gaussians, features, motion)
        return _group_seen(seen, points, goal, chosen, reason, seed)
    points = _points(gaussians, features, motion)
    # Not reused from pruning: without the pruned rows the visible shares differ. With the shares of the whole
    # scene strokes are up to 0.6 dB worse (biker, 250) or 0.3 dB better (skull, 250), over six scenes 0.02 dB
    # worse; and running the passes one by one would give another painting than the whole command.
    visible = None if features == "paper" else visible_shares(gaussians)
    weights = np.ones(num) if visible is None else cluster_weights(gaussians, visible)
    if focus is not None:
        weights = weights * focus
    found = METHODS[chosen](points, weights, num_strokes, seed=seed)
    found = keep_pure(found, points, weights, gaussians, num_strokes)
    return Grouping(
        found.labels,
        found.num_clusters,
        chosen,
        reason,
        found.num_steps,
        found.inertia,
        gaussians,
        visible=visible,
    )


def _group_seen(seen: Seen, points: F32, goal: Goal, method: str, reason: str, seed: int) -> Grouping:
    """Clusters of Gaussians by their visibility in views; `points` [N, D] are in feature space.

    They are found for Gaussians in the order of a curve through space: sums over clusters are twice as fast
    if their members are neighbors in memory.
    """
    order = morton_order(points[:, :3])
    focus = None if goal.focus is None else goal.focus[order]
    ordered, goal = Seen(seen.areas[order], seen.gaussians.take(order)), replace(goal, focus=focus)
    found = _group_ordered(ordered, points[order], order, goal, (method, reason, seed))
    assert found.visible is not None, "found with the clusters"
    labels, visible = np.empty_like(found.labels), np.empty_like(found.visible)
    labels[order], visible[order] = found.labels, found.visible
    return replace(found, labels=labels, visible=visible, gaussians=seen.gaussians)


def _group_ordered(seen: Seen, points: F32, order: Rows, goal: Goal, how: tuple[str, str, int]) -> Grouping:
    """As `_group_seen`, for rows [N] in an `order`; `how` is a method, the reason for it, and a seed."""
    method, reason, seed = how
    gaussians, weights, economy = seen.gaussians, seen.weights(goal.focus), goal.economy
    # Merged colors are weighted by opacity x area x this, the visible area.
    areas = seen_areas(gaussians)
    largest = gaussians.opacities * areas
    visible = seen.areas / np.maximum(largest, largest.max() * 1e-12)
    visible = np.maximum(visible, visible.max() * 1e-12)
    first = max(1, round(first_share(economy, FIRST_SHARE) * goal.num_strokes))
    found = STARTS[method](points, weights, first, seed=seed)
    found = keep_pure(found, points, weights, gaussians, first)

    def merged(labels: NDArray[np.intp]) -> Gaussians:
        return merge_clusters(gaussians, labels, overlap=OVERLAP, visible=visible, areas=areas)

    spans, num_rounds = spans_of(gaussians, points), NUM_ROUNDS if economy == 0 else ECONOMIC_ROUNDS
    rounds = split(found.labels, merged, points, spans, weights, goal, num_rounds, order)
    labels, parents = next(rounds), []
    for after in rounds:
        parents.append(_parents(labels, after))
        labels = after
    num = int(labels.max()) + 1
    return Grouping(
        labels.astype(np.int32),
        num,
        method,
        reason,
        found.num_steps,
        found.inertia,
        gaussians,
        num_split=num - found.num_clusters,
        visible=visible,
        parents=tuple(parents),
    )


def _points(
    gaussians: Gaussians, features: Features, motion: NDArray[np.float32] | None
) -> NDArray[np.float32]:
    points = cluster_features(gaussians, features)
    return points if motion is None else np.concatenate([points, motion], axis=1)


def _parents(before: NDArray[np.intp], after: NDArray[np.intp]) -> NDArray[np.intp]:
    """The label before a round, for each label after it; both inputs are [N]."""
    parents = np.empty(int(after.max()) + 1, np.intp)
    parents[after] = before
    return parents


def choose_method(num_points: int, num_clusters: int) -> tuple[Literal["minibatch", "lloyd"], str]:
    """The method that is faster at equal or lower inertia, and why.

    That is "lloyd" for every size measured (examples/benchmarks/cluster.py, two threads): on koala and truck
    a second at most against 0.4 to 35 s, at inertia from 0.4 % above to 34 % below; 300,000 points in 7000
    clusters take 0.5 s, in 30,000 clusters 1 s; a million in 100,000 take 4 s, against more than a quarter of
    an hour.
    It is worse where clusters are tiny (five points each: 5 % above, but in 0.05 s instead of 4) and on 9-D
    noise, which no k-d tree can search fast. "minibatch" remains as the published method.

    Args:
        num_points: N.
        num_clusters: k.
    """
    return "lloyd", f"the faster at {num_points / num_clusters:.0f} points a cluster"


def cluster_weights(gaussians: Gaussians, visible: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
    """[N] weights of Gaussians in k-means: contribution^(3/8) x color detail, relative to the largest.

    Linear weights would spend all clusters on the few largest Gaussians, equal weights on the many hidden
    ones. Large Gaussians of one color, such as a wall, need few strokes: detail (`color_detail`, at most
    0.1, plus 0.01) moves them to areas with more detail. In trained scenes nearly all areas reach that
    maximum.

    Args:
        gaussians: N Gaussians.
        visible: [N] their `visible_shares`, if known.
    """
    return np.asarray(_core.cluster_weights(contributions(gaussians, visible), color_detail(gaussians)))


def _check_choice(name: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise ValueError(f"cluster: {name} must be one of {', '.join(choices)}, got {value!r}")


def _integer(name: str, value: int, low: int, high: int | None) -> int:
    try:
        value = operator.index(value)
    except TypeError:
        raise TypeError(f"cluster: {name} must be an integer, got {type(value).__name__}") from None
    if value < low or (high is not None and value > high):
        rule = f">= {low}" if high is None else f"in {low} to {high}"
        raise ValueError(f"cluster: {name} must be {rule}, got {value}")
    return value
