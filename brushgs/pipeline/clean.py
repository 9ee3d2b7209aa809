"""The stages before clustering that drop floaters, crumbs and unseen Gaussians."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from brushgs.options.painting import CleanConfig
from brushgs.pipeline.report import Report
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.values.arrays import F64

MIN_SEEN = 0.2  # pixels; the plain picture without Gaussians that make up less is within 55 dB on five views
STRONG_HELPS = 3e-4  # share of the painted area; where only "strong" drops so much more, the report says so
SAMPLE = 20_000  # rows in which gaps between clumps are searched for
FAR_CLUMPS = (
    "the scene lies in clumps so far apart that from one the others are dots; the heaviest is painted "
    "(--clean off keeps all)"
)
MAX_VIEWS = 24  # of a path, evenly spread; they show what is seen between them


def clean_scene(
    gaussians: Gaussians, config: CleanConfig, report: Report, *, is_strokes: bool = False
) -> Gaussians:
    """Drop floaters, except from a file of strokes."""
    with report.stage("clean") as stage:
        num_before = len(gaussians)
        stage.counts = {"before": num_before, "after": num_before, "floaters": config.floaters}
        if is_strokes or config.floaters == "off":
            stage.did = "kept all"
            reason = "they are strokes already" if is_strokes else "--clean off"
            stage.skipped.append(f"search for floaters: {reason}")
            return gaussians
        from brushgs.cameras.clumps import heaviest_clump
        from brushgs.passes.reduce.clean import find_floaters

        every = slice(None, None, max(1, -(-num_before // SAMPLE)))
        clump = heaviest_clump(gaussians.means, gaussians.opacities, every)
        far = ""
        if clump is not None:
            gaussians = gaussians.take(clump)
            far = f"{num_before - len(gaussians):,} Gaussians in clumps too far away to be seen dropped; "
            report.tell(FAR_CLUMPS)
        found = find_floaters(gaussians)
        rows = found.dropped(config.floaters)
        num_dropped = int(np.count_nonzero(rows))
        share = (found.strong if config.floaters == "strong" else found.sure).share
        stage.did = f"{num_dropped:,} floaters dropped, {share:.2g} of the painted area"
        if not num_dropped:
            stage.did = "no floaters that could be seen"
        num_copies = int(np.count_nonzero(found.copies & ~rows))
        if num_copies:
            far += f"{num_copies:,} rows that repeat others and are never seen dropped; "
        stage.did = far + stage.did
        rows_left = ~(rows | found.copies)
        stage.counts |= {"after": int(np.count_nonzero(rows_left))}
        more = int(np.count_nonzero(found.strong.rows & ~rows))
        if config.floaters != "strong" and found.strong.share > share + STRONG_HELPS and not found.is_haze:
            stage.did += f"; {more:,} more may be floaters: --clean strong drops them too"
    return gaussians if rows_left.all() else gaussians.take(rows_left)


def drop_crumbs(gaussians: Gaussians, first_view: FirstView, report: Report) -> Gaussians:
    """Drop crumbs below an object, see `find_crumbs`.

    Args:
        gaussians: the scene, without floaters, N >= 1.
        first_view: of it.
        report: gets a stage only if something is dropped.
    """
    from brushgs.passes.reduce.contribution import paint_of
    from brushgs.passes.reduce.crumbs import find_crumbs

    rows = find_crumbs(gaussians, first_view)
    if not rows.any():
        return gaussians
    with report.stage("crumbs") as stage:
        paint = paint_of(gaussians)
        num_dropped, share = int(np.count_nonzero(rows)), float(paint[rows].sum() / (paint.sum() or 1))
        stage.did = f"{num_dropped:,} that hang below the object dropped, {share:.2g} of the painted area"
        stage.counts = {"before": len(gaussians), "after": len(gaussians) - num_dropped}
    return gaussians.take(~rows)


def select_seen(
    gaussians: Gaussians,
    cameras: Sequence[Camera],
    report: Report,
    *,
    at: Callable[[int], Gaussians] | None = None,
) -> Gaussians:
    """Keep the Gaussians that at least one view shows.

    Args:
        gaussians: the scene.
        cameras: the views.
        report: gets the stage.
        at: the same Gaussians, moved to the moment of a view, by its index; None for a still scene.
    """
    with report.stage("seen") as stage:
        from brushgs.rendering.visibility import visible_areas

        step = -(-len(cameras) // MAX_VIEWS)
        views = cameras[::step]
        most: F64 = np.zeros(len(gaussians))
        for number, camera in enumerate(views):
            shown = gaussians if at is None else at(number * step)
            np.maximum(most, visible_areas(shown, camera), out=most)
        is_seen = most >= MIN_SEEN
        num_seen = int(np.count_nonzero(is_seen))
        if num_seen:  # else the picture is blank anyway, and a later stage says why
            where = "this view" if len(views) == 1 else f"{len(views)} views of the path"
            stage.did = f"{num_seen:,} of {len(gaussians):,} Gaussians are seen in {where}"
        else:
            stage.did = "no Gaussian is seen: all are kept"
        stage.counts = {"before": len(gaussians), "after": num_seen or len(gaussians), "views": len(views)}
    return gaussians.take(is_seen) if num_seen else gaussians
