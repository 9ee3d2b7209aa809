"""The stage that parts a scene in what is painted and what is shown as it is."""

from brushgs.options.where import WhereConfig
from brushgs.painting.report import Report
from brushgs.painting.where import rows_where
from brushgs.scene import FirstView, Gaussians


def part(
    gaussians: Gaussians,
    config: WhereConfig,
    first_view: FirstView | None,
    report: Report,
    *,
    num_threads: int | None = None,
) -> tuple[Gaussians, Gaussians | None]:
    """What is painted, as a scene of its own, and the rest; None where that is nothing.

    Args:
        gaussians: N Gaussians.
        config: the part that is painted.
        first_view: of the scene; None only where `config.needs_first_view` is not so.
        report: gets the stage.
        num_threads: None takes the processors available to this process.

    Raises:
        ValueError: if nothing lies in it, or a term needs what there is not.
        SceneError: if a mask or the camera file cannot be used.
    """
    is_painted = rows_where(gaussians, config, first_view, report, num_threads=num_threads)
    if is_painted is None or is_painted.all():
        return gaussians, None
    return gaussians.take(is_painted), gaussians.take(~is_painted)
