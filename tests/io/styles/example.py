"""Styles to write and read."""

import numpy as np

from brushgs.values.style import (
    NamedColor,
    Residual,
    Style,
    StyleEdit,
    StyleLines,
    StyleMarks,
    StylePalette,
    StyleStage,
)


def painting(num_brushes=2, side=24) -> Style:
    """Three colors and marks with small brushes."""
    rng = np.random.default_rng(5)
    colors = [
        ("deep blue", (31, 58, 107), 0.5),
        ("ochre", (194, 138, 55), 0.3),
        ("warm white", (240, 235, 225), 0.2),
    ]
    palette = StylePalette(
        tuple(
            NamedColor(name, np.array(rgb) / 255, share, rng.normal(0, 0.04, (20, 3)).astype(np.float32))
            for name, rgb, share in colors
        )
    )
    turns = rng.uniform(0, 2 * np.pi, (9, 12))
    directions = (rng.random((9, 12, 1)) * np.stack([np.cos(turns), np.sin(turns)], axis=2)).astype(
        np.float32
    )
    brushes = tuple(rng.integers(0, 256, (side // 2, side), np.uint8) for _ in range(num_brushes))
    marks = StyleMarks(0.043, 4.25, directions, 0.02, 0.01, np.array([138, 84, 32]) / 255, 0.4, brushes)
    stage = StyleStage(
        rng.random((6, 15, 3), np.float32), 0.7 * rng.uniform(-1, 1, (6, 15, 2)).astype(np.float32)
    )
    lines = StyleLines(0.2, 0.008, np.array([20, 26, 36]) / 255)
    return Style("evening", palette, marks, stage=stage, lines=lines)


def edit(num_bumps=7) -> Style:
    """An affine map with a residual of two features."""
    rng = np.random.default_rng(6)
    residual = Residual(
        ("lightness", "height"),
        rng.normal(size=(num_bumps, 2)).astype(np.float32),
        0.8,
        rng.normal(size=(num_bumps, 4)).astype(np.float32),
        np.array([0.5, 0.1], np.float32),
        np.array([0.2, 1.5], np.float32),
        rng.normal(size=(num_bumps, 3, 3)).astype(np.float32),
    )
    return Style("warm", edit=StyleEdit(np.hstack([np.eye(3), rng.normal(0, 0.1, (3, 1))]), 0.25, residual))
