"""Clustering and the passes after it, as one function from a number of strokes to strokes.

    cluster -> solid -> direction -> repaint (-> recolor) -> broken color

A painting calls it once, the search for an error budget or a stroke size repeatedly, and the bench for each
point of its curves, so all measure what is painted.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from brushgs.options.painting import ClusterConfig
from brushgs.pipeline.report import Stopwatch
from brushgs.pipeline.runner import Memory, NoMemory
from brushgs.pipeline.stroke_pass import StrokePass
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.passes.reduce.cluster import Grouping
    from brushgs.passes.seen import Seen
    from brushgs.rendering.plain import PlainViews
    from brushgs.stroke_count.search import Clustered
    from brushgs.values.arrays import F32, F64, Mask, Rows


@dataclass(frozen=True, eq=False)
class StrokeMaker:
    """Makes strokes of a scene.

    Attributes:
        gaussians: the scene, pruned.
        cluster: how they are merged; the number of strokes is the argument of each call.
        views: small plain pictures of the scene that guide strokes; None for the scene alone.
        focus: [N] factors on the strokes per area; None for 1.
        is_solid: whether strokes that are not worth keeping are dropped, see `passes.reduce.worth`; with
            views, other strokes replace them.
        passes: applied to the clusters, in this order.
        pass_watch: adds up the seconds of all passes.
        memory: of groupings, and of strokes merged from them.
        economy: how far few large strokes cover flat areas, see `group`.
        cameras: views in which stroke length is limited to a share of the picture, see `passes.form.slabs`;
            empty for no limit.
        has_accents: whether to make fewer strokes, to leave room for accents, see `num_accents`.
        motion: [N, m] how the Gaussians move, see `group`: then the ids of strokes are the numbers of their
            clusters, or of their rows if each Gaussian is a stroke. None if nothing moves.
    """

    gaussians: Gaussians
    cluster: ClusterConfig
    views: "PlainViews | None" = None
    focus: "F64 | None" = None
    is_solid: bool = False
    economy: float = 0.0
    cameras: Sequence[Camera] = ()
    has_accents: bool = False
    passes: list[StrokePass] = field(default_factory=list)
    pass_watch: Stopwatch = field(default_factory=Stopwatch)
    memory: Memory = field(default_factory=NoMemory)
    motion: "F32 | None" = None

    @property
    def skip(self) -> str | None:
        """Why all passes are skipped, in words; None if any runs."""
        reasons = {one.skip for one in self.passes}
        if None in reasons:
            return None
        return reasons.pop() if len(reasons) == 1 else "they are switched off"

    def __call__(self, num_strokes: int) -> "Clustered":
        """At most `num_strokes` strokes, and the grouping of the Gaussians; None if each is a stroke."""
        strokes, grouping = self.clusters(num_strokes)
        return self._shortened(self.finished(strokes)), grouping

    def clusters(self, num_strokes: int) -> "Clustered":
        """The same before the passes: merged Gaussians of the scene."""
        if self.has_accents and num_strokes < len(self.gaussians):
            from brushgs.passes.add.accents import num_accents

            num_strokes -= num_accents(num_strokes, self.economy)
        of_scene = self.gaussians, num_strokes, self.cluster, self.views, self.focus
        makes = *of_scene, self.is_solid, self.economy, tuple(self.cameras)
        return self.memory.of("cluster", makes, lambda: self._clustered(num_strokes))

    def of_groups(
        self, grouping: "Grouping", into: "Rows | None" = None, *, most: int
    ) -> "tuple[Gaussians, Rows]":
        """The strokes of a grouping, or coarser ones.

        Args:
            grouping: of the scene, as a call returned it.
            into: [num_clusters] the group of each cluster; None makes the strokes of the call.
            most: the largest number of strokes.

        Returns:
            The strokes, and the cluster or group of each, ascending.
        """
        strokes, clusters = self._merged(grouping, most, into)
        strokes = self.finished(strokes)  # coarser strokes of a growing painting may be longer
        return (strokes if into is not None else self._shortened(strokes)), clusters

    def _clustered(self, num_strokes: int) -> "Clustered":
        grouping = self._grouped(num_strokes)
        if grouping is None:
            return self._with_ids(self.gaussians, np.arange(len(self.gaussians))), None
        return self._merged(grouping, num_strokes)[0], grouping

    def finished(self, strokes: Gaussians) -> Gaussians:
        """Strokes after all passes."""
        with self.pass_watch.running():
            for one in self.passes:
                strokes = one(strokes)
        return strokes

    def _grouped(self, num_strokes: int) -> "Grouping | None":
        if len(self.gaussians) <= num_strokes:
            return None
        from brushgs.passes.reduce.cluster import group

        config = self.cluster
        return group(
            self.gaussians,
            num_strokes,
            features=config.features,
            method=config.method,
            seed=config.seed,
            views=self.views,
            focus=self.focus,
            worth_keeping=_worth_keeping if self.is_solid else None,
            motion=self.motion,
            economy=self.economy,
            cameras=self.cameras,
            seen=self._seen(),
        )

    def _seen(self) -> "Seen | None":
        """What the views show of the Gaussians, for any number of strokes."""
        gaussians, views = self.gaussians, self.views
        if views is None or gaussians.finest is None:
            return None
        from brushgs.passes.seen import seen_in

        return self.memory.of(
            "visibility", (gaussians, views), lambda: seen_in(gaussians, views), is_only=True
        )

    def _merged(
        self, grouping: "Grouping", most: int, into: "Rows | None" = None
    ) -> "tuple[Gaussians, Rows]":
        """The strokes that are worth keeping, at most `most`, and the cluster of each."""
        strokes = grouping.merged(self.cluster.merge, into)
        rows = np.arange(len(strokes))
        if self.is_solid:
            rows = np.flatnonzero(_worth_keeping(strokes))
            rows = rows[_most_worth(strokes.take(rows), most)]
        strokes = strokes if len(rows) == len(strokes) else strokes.take(rows)
        return self._with_ids(strokes, rows), rows

    def _shortened(self, strokes: Gaussians) -> Gaussians:
        """Strokes shortened to the limit in the cameras, after the passes that turn them."""
        if not self.cameras:
            return strokes
        from brushgs.passes.form.slabs import shorten_slabs

        return shorten_slabs(strokes, self.cameras)

    def _with_ids(self, strokes: Gaussians, ids: "Rows") -> Gaussians:
        return strokes if self.motion is None else replace(strokes, ids=ids.astype(np.int32))


def _worth_keeping(strokes: Gaussians) -> "Mask":
    """Mask [k] of the visible strokes; all if none is visible."""
    from brushgs.passes.reduce.worth import worth_keeping

    kept = worth_keeping(strokes)
    return kept if kept.any() else ~kept


def _most_worth(strokes: Gaussians, most: int) -> "Rows":
    """Rows of at most `most` strokes: extra ones are made in place of those not worth keeping, perhaps too
    many.
    """
    if len(strokes) <= most:
        return np.arange(len(strokes))
    from brushgs.passes.reduce.contribution import contributions
    from brushgs.passes.reduce.prune import highest

    return np.flatnonzero(highest(contributions(strokes), most))
