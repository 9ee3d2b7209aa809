"""Mix several styles by their shares into one style and a picture that shows it, for `refine --style`.

The palette contains the colors of all styles by share; marks have the mean of sizes and directions, and the
brushes of all. A single style with share 1 stays unchanged. The dials of contours and stage have no effect,
because these are no strokes of the scene.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from brushgs.options.styling import StyleConfig
from brushgs.refine.painting_style import PaintingStyle, open_style, painted
from brushgs.values.arrays import F32
from brushgs.values.style import Style, StyleMarks, StylePalette

MOST_BRUSHES = 8  # in a mix


def open_styles(config: StyleConfig) -> PaintingStyle:
    """Open paintings and style files, and mix them.

    Raises:
        SceneError: if a file cannot be read, or is the style of an edit.
    """
    opened = [open_style(file) for file in config.files]
    if config.only is not None:
        return opened[0]
    style = mixed([one.style for one in opened], config)
    return PaintingStyle(style, opened[0].painting if len(opened) == 1 else painted(style))


def mixed(styles: Sequence[Style], config: StyleConfig) -> Style:
    """Mix styles of paintings by the shares and dials in `config`."""
    colors = []
    for style, one in zip(styles, config.styles, strict=True):
        assert style.palette is not None, "a painting has colors"
        share = one.share * one.color
        colors += [replace(color, share=color.share * share) for color in style.palette.colors if share > 0]
    total = sum(color.share for color in colors)
    palette = styles[0].palette  # used with strength 0
    if total > 0:
        palette = StylePalette(tuple(replace(color, share=color.share / total) for color in colors))
    name = " and ".join(style.name for style in styles)[:80]
    return Style(name, palette, _marks(styles, config))


def _marks(styles: Sequence[Style], config: StyleConfig) -> StyleMarks | None:
    """The marks of a mix; None if no style with a share has any."""
    parts = [
        (style.marks, one.share * one.marks, one.direction)
        for style, one in zip(styles, config.styles, strict=True)
        if style.marks is not None and one.share * one.marks > 0
    ]
    if not parts:
        return None
    marks, weights, turns = zip(*parts, strict=True)
    shares = np.array(weights) / sum(weights)
    largest: StyleMarks = marks[int(shares.argmax())]
    rows, columns = largest.directions.shape[:2]
    directions = sum(
        share * turn * _on_grid(one.directions, rows, columns)
        for one, share, turn in zip(marks, shares, turns, strict=True)
    )

    def mean(name: str) -> float:
        return float(shares @ np.array([getattr(one, name) for one in marks]))

    brushes = [
        brush
        for one, share in zip(marks, shares, strict=True)
        for brush in one.brushes[: max(round(MOST_BRUSHES * share), 1)]
    ]
    return replace(
        largest,
        length=float(np.exp(shares @ np.log([one.length for one in marks]))),
        aspect=float(np.exp(shares @ np.log([one.aspect for one in marks]))),
        directions=np.asarray(directions, np.float32),
        broken_lightness=mean("broken_lightness"),
        broken_chroma=mean("broken_chroma"),
        relief=mean("relief"),
        brushes=tuple(brushes),
    )


def _on_grid(directions: F32, rows: int, columns: int) -> F32:
    """Directions [h, w, 2] resampled to another grid, by nearest neighbor."""
    i = (np.arange(rows) + 0.5) * directions.shape[0] // rows
    j = (np.arange(columns) + 0.5) * directions.shape[1] // columns
    return np.asarray(directions[i.astype(int)[:, None], j.astype(int)])
