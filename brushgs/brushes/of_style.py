"""The brushes of a style: which there are, and the marks of its dictionary as colored brushes.

They are numbered from 1: first those without colors, then the marks of the dictionary.
"""

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np

from brushgs.brushes.texture import StrokeTexture, Tint, brush_of_style
from brushgs.values.colors import rgb_of_oklab
from brushgs.values.style import MarkDictionary, StyleMarks, residuals_of

RAISED = 2.5  # height by lightness: a mark that is 0.2 lighter than its mean stands as high as paint does
# Contrast of a mark, OKLab lightness: from the first on it is laid with more than it has, at the second with
# the most. Width, of the shorter side: up to the first with all of that, from the second with none. Chroma
# takes a third of the excess.
DIFFERENT, WIDTHS = (0.015, 0.04), (0.005, 0.015)
MOST_CONTRAST, OF_CHROMA = 2.0, 1 / 3


def marks_of(path: Path) -> StyleMarks | None:
    """The marks of a style file. Raises SceneError as `read_style` does."""
    try:
        stat = path.stat()
    except OSError:
        return _read(path, 0, 0)
    return _read(path, stat.st_mtime_ns, stat.st_size)


@lru_cache(maxsize=4)
def _read(path: Path, time: int, size: int) -> StyleMarks | None:
    """A file is read once for all its brushes, and again after it changed."""
    from brushgs.formats.styles import read_style

    return read_style(path).marks


def laid_contrast(contrast: float, width: float) -> float:
    """Factor on the differences within a mark of a contrast, OKLab, and a width, 1 to 2.

    Narrow marks overlap and are filtered: that halves the contrast of busy ones, hardly that of calm ones.
    Wide marks keep theirs.
    """
    share, narrow = (
        np.clip((value - low) / (high - low), 0, 1)
        for value, (low, high) in ((contrast, DIFFERENT), (width, WIDTHS))
    )
    return float(1 + (MOST_CONTRAST - 1) * share * (1 - narrow))


def mark_texture(marks: MarkDictionary, row: int, name: str, width: float) -> StrokeTexture:
    """A mark of a dictionary as a brush: its colors are added to that of a stroke, its lights are raised.

    Args:
        marks: the dictionary.
        row: of the mark.
        name: of the brush.
        width: of the painting's marks, a share of its shorter side.
    """
    residual = residuals_of(marks.texels[row])
    coverage = np.ascontiguousarray(marks.texels[row, ..., 3])
    mean = marks.colors[row].astype(np.float64)
    contrast = laid_contrast(float(marks.contrasts[row]), width)
    chroma = 1 + OF_CHROMA * (contrast - 1)
    laid = mean + residual * (contrast, chroma, chroma)
    rgb = np.clip(rgb_of_oklab(laid.reshape(-1, 3)), 0, 1).reshape(residual.shape)
    own = np.clip(rgb_of_oklab(mean[None]), 0, 1)[0]
    height = np.clip(0.5 + RAISED * residual[..., 0], 0, 1).astype(np.float32)
    return StrokeTexture("image", name, coverage, height, tint=Tint.of(rgb, coverage, own))


def names_of_style(path: Path, marks: StyleMarks | None) -> tuple[str, ...]:
    """Names of what paints in a style: the marks of its dictionary; without one its brushes."""
    if marks is None:
        return ()
    num = len(marks.brushes)
    numbers = range(1, num + 1)
    if marks.dictionary is not None:
        numbers = range(num + 1, num + len(marks.dictionary) + 1)
    return tuple(f"{path}:{number}" for number in numbers)


def fitting(names: Sequence[str], room: int) -> tuple[str, ...]:
    """As many brushes of styles as a set has room for: of each style the first."""
    unique = tuple(dict.fromkeys(names))
    if len(unique) <= room:
        return unique
    rank: dict[str, int] = {}
    seen: dict[str, int] = {}
    for name in unique:
        of_style = brush_of_style(name)
        group = name if of_style is None else str(of_style[0])
        rank[name] = seen[group] = seen.get(group, -1) + 1
    kept = set(sorted(unique, key=lambda name: rank[name])[: max(room, 0)])
    return tuple(name for name in unique if name in kept)
