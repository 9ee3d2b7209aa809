"""Few pigments: move the colors of strokes toward a small palette of the scene."""

import numpy as np

from brushgs.passes.color.tone import painted_areas
from brushgs.passes.reduce.lloyd import lloyd
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors, in_colors

HUE = 2.0  # weight of a and b over that of L: two pigments should differ in hue
SHARE = 0.85  # of the way to the pigment: 1 makes faces of five flat patches


def use_pigments(strokes: Gaussians, num_pigments: int, *, share: float = SHARE, seed: int = 0) -> Gaussians:
    """Move the colors of strokes to the means of weighted k-means in OKLab.

    Args:
        strokes: k strokes.
        num_pigments: >= 1; fewer if strokes have fewer colors.
        share: of the way, 0 to 1.
        seed: of the start of k-means.

    Returns:
        The strokes in colors that do not depend on the view.

    Raises:
        ValueError: if `num_pigments` is below 1.
    """
    if num_pigments < 1:
        raise ValueError(f"use_pigments: num_pigments must be at least 1, got {num_pigments}")
    if len(strokes) == 0:
        return strokes
    lab = oklab_of(base_colors(strokes.sh))
    paint = np.sqrt(painted_areas(strokes))  # not areas: accents keep their colors
    paint += 1e-12 * (paint.max() or 1.0)
    points = (lab * (1, HUE, HUE)).astype(np.float32)
    labels = lloyd(points, paint, min(num_pigments, len(strokes)), seed=seed).labels
    totals = np.bincount(labels, paint)
    means = np.stack([np.bincount(labels, paint * lab[:, i]) / totals for i in range(3)], axis=1)
    colors = rgb_of_oklab((1 - share) * lab + share * means[labels])
    return in_colors(strokes, np.clip(colors, 0, 1))
