"""Read moving scenes from files: one module per format, listed in `table.py`.

Heavy modules are imported only when a file is read.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from brushgs.options.scene_source import SceneFiles
    from brushgs.values.moving import MovingScene

__all__ = ["load_moving", "open_moving"]


def load_moving(scene: "SceneFiles", *, moments_per_second: float | None = None) -> "MovingScene":
    """Open a moving scene; a still scene gives one of duration 0.

    Args:
        scene: a file of a moving scene (its content, not its suffix, decides the format); a folder or several
            files, one per moment; or a still scene, see `brushgs.load`.
        moments_per_second: rate of numbered files, above 0; None for that of the source, or 24.

    Raises:
        SceneError: if a file cannot be used, or needs a network or a pickle; says what would work. Also if a
            rate is given for a scene that is not stored as one file per moment.
        ValueError: if the rate is not above 0.

    Example:
        >>> for moment in range(3):
        ...     bg.save(gaussians, f"frame_{moment:03}.ply")
        >>> bg.load_moving(["frame_000.ply", "frame_001.ply", "frame_002.ply"])
        MovingScene(...)
    """
    import numpy as np

    from brushgs.formats.scenes.read import read_scene
    from brushgs.options.scene_source import SceneSource
    from brushgs.values.moving import MovingScene

    source = SceneSource.of(scene, moments_per_second=moments_per_second)
    moving = open_moving(source)
    if moving is not None:
        return moving
    gaussians, notes = read_scene(source)
    resting = np.ones(len(gaussians), np.bool_)
    return MovingScene(0.0, True, lambda time: gaussians, resting=resting, notes=notes)


def open_moving(scene: "SceneFiles") -> "MovingScene | None":
    """Open a moving scene like `load_moving`; return None for a still scene.

    Raises SceneError as `load_moving` does, except for faults that only the reader of still scenes finds.
    """
    from brushgs.formats.moving.frames import open_frames
    from brushgs.formats.moving.moment import open_formula
    from brushgs.options.scene_source import SceneSource

    source = SceneSource.of(scene)
    return open_formula(source) or open_frames(source)
