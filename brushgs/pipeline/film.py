"""A film of a moving scene, in memory or in files."""

from pathlib import Path

from brushgs.options.clip import ClipConfig
from brushgs.options.painting import PaintConfig
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.options.sequence import PathConfig, SequenceConfig
from brushgs.pipeline.clip import Clip
from brushgs.pipeline.report import Report
from brushgs.pipeline.sequence import paint_sequence
from brushgs.values.camera import Camera
from brushgs.values.moving import MovingScene


def film_of(
    scene: MovingScene | SceneFiles,
    output: str | Path,
    config: PaintConfig,
    how: tuple[Camera | PathConfig | None, ClipConfig | None, SequenceConfig],
    report: Report | None,
) -> Report:
    """Paint a moving scene; `how` is the camera, the shown part, and where frames are painted."""
    camera, clip, workers = how
    source = None
    if not isinstance(scene, MovingScene):
        from brushgs.formats.moving import load_moving

        source = SceneSource.of(scene)
        scene = load_moving(source)
    film = Clip(scene, clip or ClipConfig(), source)
    return paint_sequence(film, output, camera, config, workers, report=report)
