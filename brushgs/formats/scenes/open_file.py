"""One scene file of any format is opened, and what it holds looked over."""

import warnings
from pathlib import Path

from brushgs.errors import SceneError, SceneWarning
from brushgs.formats.registry import function_of
from brushgs.formats.scenes.columns import Columns
from brushgs.formats.scenes.identify import find_format
from brushgs.formats.scenes.scene_file import SceneFile

# Limits for `warn_of_other_encoding`.
_MIN_ROWS = 10
_SIGMOID_OF_1 = 0.7310587
_MIN_SPREAD = 0.01  # of opacities; scripts write equal ones, which may be in either encoding
_BLINDING = 16.0  # a coefficient of 16 is five times as bright as white; trained scenes reach 12.6
_NUM_COLORS = 4096  # colours that are inspected


def open_file(path: Path, lod: int | None) -> SceneFile:
    """Read the header of one file, or of a folder that is a scene, with the module of its format.

    Raises:
        NoGaussiansError: if it is sound, and holds none.
        SceneError: if it is of no known format or damaged, or has no levels of detail and one is asked for.
    """
    scene_format = find_format(path)
    open_scene = function_of(scene_format.read)
    if lod is not None and not scene_format.has_levels:
        raise SceneError(
            path, f"is a {scene_format.name}, which has no levels of detail; omit the level (lod)"
        )
    file: SceneFile = open_scene(path, lod) if scene_format.has_levels else open_scene(path)
    return file


def drop_unnamed_brushes(file: SceneFile, columns: Columns) -> None:
    """Drop the brushes of strokes where some are not among those that the file names."""
    if columns.brushes is None or not file.brushes:
        return
    if (row := int(columns.brushes.max(initial=0))) >= len(file.brushes):
        columns.brushes = None
        message = f"strokes have brush {row} and the header names {len(file.brushes)}; brushes are dropped"
        warnings.warn(SceneWarning(f"{file.path}: {message}"), stacklevel=3)


def warn_of_other_encoding(path: Path, columns: Columns) -> None:
    """Warn of a file whose numbers cannot be in the standard layout; only where that is certain.

    Decoded as a log, a scale of 0 and more is at least 1; decoded as a logit, an opacity of 0 to 1 is 0.5 to
    0.7311. No trained scene has all of its rows there; a few rows made by hand may. Colours of 0 to 255
    decoded as coefficients are blinding. This inspects the smallest and largest opacity and scale, and some
    colours, which takes 1 % of the loading time.
    """
    if len(columns.means) < _MIN_ROWS:
        return
    suspects = []
    low, high = columns.opacities.min(), columns.opacities.max()
    if low >= 0.5 and high <= _SIGMOID_OF_1:
        are_scales_linear = columns.scales.min() >= 1
        if are_scales_linear or high - low > _MIN_SPREAD:
            suspects.append("scales and opacities" if are_scales_linear else "opacities")
    colors = columns.sh[:_NUM_COLORS, 0]
    if colors.min() >= 0 and colors.max() > _BLINDING:
        suspects.append("colours")
    if suspects:
        message = f"{' and '.join(suspects)} seem to be stored in another encoding, which paints a fog"
        cure = f"'brushgs doctor {path} --fix cured.ply' converts them"
        warnings.warn(SceneWarning(f"{path}: {message}; {cure}"), stacklevel=3)
