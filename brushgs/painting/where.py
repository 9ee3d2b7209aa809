"""The stage that finds which Gaussians, or strokes, lie in the part of a scene that is meant."""

import numpy as np

from brushgs.arrays import F64, Mask
from brushgs.options.where import WhereConfig
from brushgs.painting.report import Report
from brushgs.scene import FirstView, Gaussians


def where_in(
    gaussians: Gaussians,
    config: WhereConfig | None,
    first_view: FirstView | None,
    report: Report,
    *,
    what: str = "Gaussians",
    num_threads: int | None = None,
) -> F64 | None:
    """[N] memberships, 0 to 1, as one stage of a report; None, without a stage, where all is meant.

    Args:
        gaussians: N Gaussians; of a moving scene at their reference moment.
        config: the part; None for all.
        first_view: of the scene; None only where `config.needs_first_view` is not so.
        report: gets the stage.
        what: they are called.
        num_threads: None takes the processors available to this process. The result does not depend on it.

    Raises:
        ValueError: if nothing lies in it, or a term needs what there is not.
        SceneError: if a mask or the camera file cannot be used.
    """
    if config is None:
        return None
    with report.stage("where") as stage:
        from brushgs.painting.masks import MaskOpener
        from brushgs.passes.where import WhereContext, memberships

        context = WhereContext(
            first_view,
            config.soft,
            None if config.camera_file is None else MaskOpener(config.camera_file),
            num_threads=num_threads,
        )
        found = memberships(config.expression, gaussians, context)
        is_in = found > 0
        num, total = int(np.count_nonzero(is_in)), len(gaussians)
        stage.did = f"{num:,} of {total:,} {what} in {config.expression}"
        if num_part := int(np.count_nonzero(is_in & (found < 1))):
            stage.did += f", {num_part:,} of them in part"
        stage.counts = {"inside": num, "of": total, "in_part": num_part, "where": str(config)}
        if not num:
            raise ValueError(
                f"where: none of {total:,} {what} lies in {config.expression}; `brushgs info` prints where "
                "the scene is"
            )
        if num == total and not num_part:
            stage.skipped.append("limiting to a part: all of the scene lies in it")
    return found


def rows_where(
    gaussians: Gaussians,
    config: WhereConfig | None,
    first_view: FirstView | None,
    report: Report,
    *,
    what: str = "Gaussians",
    num_threads: int | None = None,
) -> Mask | None:
    """[N] `where_in`, with each Gaussian on one side: of a soft edge those that `sides` says."""
    found = where_in(gaussians, config, first_view, report, what=what, num_threads=num_threads)
    if found is None:
        return None
    from brushgs.passes.where import sides

    return sides(found, gaussians)
