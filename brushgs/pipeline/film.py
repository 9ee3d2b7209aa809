"""A film of a moving scene, from Python."""

from pathlib import Path
from typing import TYPE_CHECKING

from brushgs.options.clip import ClipConfig
from brushgs.options.look import Look, config_of
from brushgs.options.painting import PaintConfig
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.pipeline.clip import Clip
from brushgs.pipeline.report import Report
from brushgs.pipeline.sequence import paint_sequence
from brushgs.values.camera import Camera
from brushgs.values.moving import MovingScene

if TYPE_CHECKING:
    from brushgs.options.sequence import PathConfig


def paint_film(
    scene: MovingScene | SceneFiles,
    output: str | Path,
    look: PaintConfig | Look | str | Path | None = None,
    *,
    camera: "Camera | PathConfig | None" = None,
    clip: ClipConfig | None = None,
    report: Report | None = None,
) -> Report:
    """Paint a moving scene, as `brushgs render` does: strokes live as long as what they paint.

    Args:
        scene: in memory, or its files, see `load_moving`. A still scene is one frame.
        output: a video (.mp4, .webm, .gif), or numbered pictures such as frames/%05d.png.
        look: see `paint`.
        camera: one that stands still, or a path; None for the view that the options describe.
        clip: the part that is shown, its speed and rate, and whether it loops; None for all of it.
        report: gets the stages; a new one if None.

    Returns:
        The report, with one stage per step.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if an option does not suit the scene or the output.

    Example:
        >>> from brushgs.still_life.moving import still_life_moving
        >>> scene = still_life_moving(2000, seconds=0.2)
        >>> report = bg.paint_film(scene, "clip.mp4", camera=camera, clip=bg.ClipConfig(fps=10))
        >>> report.output
        'clip.mp4'
    """
    source = None
    if not isinstance(scene, MovingScene):
        from brushgs.io.moving import load_moving

        source = SceneSource.of(scene)
        scene = load_moving(source)
    return paint_sequence(
        Clip(scene, clip or ClipConfig(), source), output, camera, config_of(look), report=report
    )
