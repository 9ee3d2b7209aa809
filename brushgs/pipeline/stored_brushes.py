"""The brushes of a file of strokes, used unless others are requested."""

import warnings
from pathlib import Path
from typing import TYPE_CHECKING

from brushgs.errors import SceneError, SceneWarning
from brushgs.formats.files import exists
from brushgs.options.look_parts import BrushesConfig
from brushgs.options.painting import DEFAULT_SIZE
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.pipeline.report import Report
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.brushes.brush_set import BrushSet
    from brushgs.brushes.kit import BrushKit
    from brushgs.values.notes import LoadNotes


def open_stored_brushes(
    gaussians: Gaussians,
    notes: "LoadNotes | None",
    source: SceneFiles,
    named: BrushesConfig,
    size: tuple[int, int] | None,
    report: Report,
) -> "tuple[BrushSet, BrushKit] | None":
    """The stored brushes of strokes; None if the painting has others, or they cannot be opened.

    Args:
        gaussians: as loaded.
        notes: of their file.
        source: the file; brushes that are files are looked for beside it first.
        named: the brushes of the painting.
        size: (width, height) of the picture, pixels; None for the usual one.
        report: gets a stage if there are any.
    """
    if gaussians.brushes is None or notes is None or not notes.is_strokes or not notes.brushes:
        return None
    if not named.are_usual:
        return None
    folder = SceneSource.of(source).paths[0].parent
    with report.stage("stored brushes") as stage:
        from brushgs.brushes.brush_set import size_for
        from brushgs.brushes.kit import BrushKit

        kit = BrushKit(other=tuple(_located(name, folder) for name in notes.brushes))
        try:
            texture = kit.open(size=size_for(*(size or DEFAULT_SIZE)))
        except SceneError as error:
            stage.did = "none"
            stage.skipped.append(f"the brushes that strokes have: {error}")
            message = f"the brushes of its strokes cannot be opened ({error}); those of the look paint them"
            warnings.warn(SceneWarning(f"{SceneSource.of(source).name}: {message}"), stacklevel=2)
            return None
        names = list(texture.names)
        stage.did = f"{len(names)} brush{'es' * (len(names) != 1)} that strokes have: {', '.join(names[:6])}"
        stage.counts = {"brushes": names}
    return texture, kit


def _located(name: str, folder: Path) -> str:
    """The name to open for a stored brush: the path beside the file of strokes if there is such a file."""
    from brushgs.brushes.texture import brush_of_style, variants_of

    if variants := variants_of(name):
        return f"{name}_1" if len(variants) > 1 else name
    of_style = brush_of_style(name)
    path = Path(name) if of_style is None else of_style[0]
    if not exists(folder / path):
        return name
    return str(folder / path) if of_style is None else f"{folder / path}:{of_style[1]}"
