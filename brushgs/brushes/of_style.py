"""The brushes of a style: their names, and the marks of its dictionary as colored brushes.

Brushes are numbered from 1: first those without colors, then the marks of the dictionary.
"""

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np

from brushgs.brushes.texture import StrokeTexture, Tint, brush_of_style
from brushgs.values.colors import rgb_of_oklab
from brushgs.values.style import MarkDictionary, StyleMarks, residuals_of

RAISED = 2.5  # height per lightness: a mark 0.2 lighter than its mean is as high as full paint
# Contrast of a mark, OKLab lightness: amplification starts at the first value and is full from the second.
# Width of a mark, of the shorter side: up to the first value amplification is full, from the second there is
# none. Chroma takes a third of the excess.
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
    """Read a file once for all its brushes, and again after it changed."""
    from brushgs.formats.styles import read_style

    return read_style(path).marks


def laid_contrast(contrast: float, width: float) -> float:
    """Amplification of the differences within a mark, 1 to 2, by its contrast (OKLab) and width.

    Narrow marks overlap and are filtered: that halves the contrast of busy marks and hardly changes calm
    ones. Wide marks are not amplified.
    """
    share, narrow = (
        np.clip((value - low) / (high - low), 0, 1)
        for value, (low, high) in ((contrast, DIFFERENT), (width, WIDTHS))
    )
    return float(1 + (MOST_CONTRAST - 1) * share * (1 - narrow))


def mark_texture(marks: MarkDictionary, row: int, name: str, width: float) -> StrokeTexture:
    """A mark of a dictionary as a brush: its colors are added to the stroke's, its lights are raised.

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
    """Names of the brushes that paint in a style: the marks of its dictionary, or without one its brushes."""
    if marks is None:
        return ()
    num = len(marks.brushes)
    numbers = range(1, num + 1)
    if marks.dictionary is not None:
        numbers = range(num + 1, num + len(marks.dictionary) + 1)
    return tuple(f"{path}:{number}" for number in numbers)


def fitting(names: Sequence[str], room: int) -> tuple[str, ...]:
    """As many brushes of styles as fit into a set: the first ones of each style."""
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
