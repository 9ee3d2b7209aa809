"""Styles to write and read."""

import numpy as np

from brushgs.values import style
from brushgs.values.style import Style


def painting(num_brushes=2, side=24) -> Style:
    """Three colors and marks with small brushes."""
    rng, names = np.random.default_rng(5), ("deep blue", "ochre", "warm white")
    colors = np.array([(31, 58, 107), (194, 138, 55), (240, 235, 225)]) / 255
    offsets = [rng.normal(0, 0.04, (20, 3)).astype(np.float32) for _ in names]
    rows = zip(names, colors, (0.5, 0.3, 0.2), offsets, strict=True)
    palette = style.StylePalette(tuple(style.NamedColor(*row) for row in rows))
    turns = rng.uniform(0, 2 * np.pi, (9, 12))
    directions = rng.random((9, 12, 1)) * np.stack([np.cos(turns), np.sin(turns)], axis=2)
    brushes = tuple(rng.integers(0, 256, (side // 2, side), np.uint8) for _ in range(num_brushes))
    ground, directions = np.array([138, 84, 32]) / 255, directions.astype(np.float32)
    marks = style.StyleMarks(0.043, 4.25, directions, 0.02, 0.01, ground, 0.4, brushes)
    colors, toward = rng.random((6, 15, 3), np.float32), 0.7 * rng.uniform(-1, 1, (6, 15, 2))
    stage = style.StyleStage(colors, toward.astype(np.float32))
    lines = style.StyleLines(0.2, 0.008, np.array([20, 26, 36]) / 255)
    return Style("evening", palette, marks, stage=stage, lines=lines)


def edit(num_bumps=7) -> Style:
    """An affine map with a residual of two features."""
    rng = np.random.default_rng(6)
    shapes = (num_bumps, 2), (num_bumps, 4), (num_bumps, 3, 3)
    centers, weights, slopes = (rng.normal(size=shape).astype(np.float32) for shape in shapes)
    offset, scale = np.array([[0.5, 0.1], [0.2, 1.5]], np.float32)
    residual = style.Residual(("lightness", "height"), centers, 0.8, weights, offset, scale, slopes)
    affine = np.hstack([np.eye(3), rng.normal(0, 0.1, (3, 1))])
    return Style("warm", edit=style.StyleEdit(affine, 0.25, residual))
