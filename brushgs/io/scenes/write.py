"""Gaussians become a scene file; its suffix decides the format."""

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

from brushgs.io.formats import find_by_suffix
from brushgs.io.scenes.formats import SCENE_SUFFIXES, WRITTEN_SCENES
from brushgs.scene import FirstView, Gaussians


def write_scene(
    gaussians: Gaussians,
    path: str | Path,
    *,
    is_strokes: bool = False,
    scene: str | None = None,
    first_view: FirstView | None = None,
    brushes: Sequence[str] = (),
) -> None:
    """Write Gaussians to a scene file, which appears when it is complete.

    Args:
        gaussians: N >= 1 Gaussians.
        path: the suffix decides the format, see `SCENE_SUFFIXES`.
        is_strokes: whether the file records that its Gaussians are strokes: painting keeps all of them by
            default.
        scene: name of the scene that they were made of, which the file records.
        first_view: of that scene, which the file records: it is seen by the same cameras as the scene.
        brushes: names or paths of the brushes that `gaussians.brushes` are rows of, which the file records.

    Raises:
        ValueError: if the suffix is of no format, there are no Gaussians, or a value does not fit the format.
        SceneError: if the file cannot be written.
    """
    scene_format = find_by_suffix(WRITTEN_SCENES, path)
    if scene_format is None:
        known = ", ".join(SCENE_SUFFIXES)
        raise ValueError(f"save: Gaussians must go to a {known} file, got {str(path)!r}; change the suffix")
    writer = import_module(f"brushgs.io.scenes.{scene_format.writer}")
    writer.write_scene(
        gaussians, path, is_strokes=is_strokes, scene=scene, first_view=first_view, brushes=brushes
    )
