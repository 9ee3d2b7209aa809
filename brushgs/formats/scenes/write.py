"""Gaussians become a scene file; its suffix decides the format."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from brushgs.formats.registry import SCENE_SUFFIXES, find_written, function_of
from brushgs.formats.scenes.stored import Stored
from brushgs.values.camera import FirstView
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.formats.scenes.losses import Losses


def write_scene(
    gaussians: Gaussians,
    path: str | Path,
    *,
    is_strokes: bool = False,
    scene: str | None = None,
    first_view: FirstView | None = None,
    brushes: Sequence[str] = (),
    measures: bool = False,
) -> "Losses | None":
    """Write Gaussians to a scene file, which appears when it is complete.

    Args:
        gaussians: N >= 1 Gaussians.
        path: the suffix decides the format, see `SCENE_SUFFIXES`.
        is_strokes: whether the file records that its Gaussians are strokes: painting keeps all of them by
            default.
        scene: name of the scene that they were made of, which the file records.
        first_view: of that scene, which the file records: it is seen by the same cameras as the scene.
        brushes: names or paths of the brushes that `gaussians.brushes` are rows of, which the file records.
        measures: whether to read the file back and measure its errors, where its format rounds numbers.

    Returns:
        What rounding changed, if that was measured.

    Raises:
        ValueError: if the suffix is of no format, there are no Gaussians, or a value does not fit the format.
        SceneError: if the file cannot be written.
    """
    scene_format = find_written("scene", path)
    if scene_format is None:
        known = ", ".join(SCENE_SUFFIXES)
        raise ValueError(f"save: Gaussians must go to a {known} file, got {str(path)!r}; change the suffix")
    _check(gaussians, brushes)
    named = () if gaussians.brushes is None else tuple(brushes)
    stored = Stored(scene, first_view, named, is_strokes=is_strokes, antialiased=gaussians.antialiased)
    order = function_of(scene_format.write)(gaussians, path, stored)
    if not (measures and scene_format.rounds):
        return None
    from brushgs.formats.scenes.losses import measure_losses

    return measure_losses(gaussians, path, order)


def _check(gaussians: Gaussians, brushes: Sequence[str]) -> None:
    """Refuse what no format holds."""
    if not len(gaussians):
        raise ValueError(
            "save: gaussians must have at least one row, got 0; an empty scene cannot be read back"
        )
    for name in ("means", "quats", "scales", "sh"):
        if np.abs(getattr(gaussians, name)).max() > np.finfo(np.float32).max:
            raise ValueError(f"save: {name} must fit float32, got larger values; shrink the scene first")
    if gaussians.brushes is not None and brushes and (row := int(gaussians.brushes.max())) >= len(brushes):
        raise ValueError(
            f"save: brushes must be rows of the {len(brushes)} that are named, got {row}; choose them anew"
        )
