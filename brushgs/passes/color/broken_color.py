"""Broken color: make each stroke a little lighter or darker, warmer or cooler.

Painters do not mix one color for a whole wall; neighboring strokes differ, and the eye mixes them. Every
stroke gets a small normal shift in OKLab minus the mean shift around it, so that local mean colors stay.
Shifts are hashes of position and seed, independent of order and camera. With `follows`, shifts scale with
chroma: grays stay gray and vary only in lightness; pure colors vary in chroma more than in hue.
"""

import operator
from dataclasses import replace

import numpy as np

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.values.colors import CONES_FROM_RGB, OKLAB_FROM_ROOTS
from brushgs.values.gaussians import Gaussians

# Standard deviations of L, and of a and b, in OKLab. 6000 strokes, mean of six scenes: -0.17 dB (koala -0.3);
# 0.011 and 0.005 cost 0.08 and are hardly visible, 0.022 and 0.010 cost 0.31 and turn fur to confetti.
LIGHTNESS, CHROMA = 0.016, 0.007
MOST = 0.5
MAX_SEED = 2**32 - 1


def break_colors(
    strokes: Gaussians,
    lightness: float = LIGHTNESS,
    chroma: float = CHROMA,
    *,
    follows: float = 0.0,
    seed: int = 0,
) -> Gaussians:
    """Vary the colors of strokes; local means stay.

    Only the view-independent part of a color changes. No channel leaves the display range: near black, white
    and pure colors shifts shrink equally in both directions, and colors outside do not move further out.
    White paper stays white.

    Args:
        strokes: k strokes.
        lightness: standard deviation of the shift of OKLab L, 0 (black) to 1 (white); 0 to 0.5.
        chroma: standard deviation of the shifts of OKLab a and b, likewise.
        follows: 0 (same for all strokes) to 1: scale shifts of a and b with the stroke's chroma, from none
            for a gray to full at 0.08, mostly along its hue.
        seed: 0 to 2^32 - 1.

    Returns:
        The strokes with other `sh`, in the same dtype; the input itself if both deviations are 0 or k = 0.

    Raises:
        TypeError: if `seed` is not an integer.
        ValueError: if an option is out of range.

    Strokes at the same place get the same shift. Scaling or moving the scene gives other shifts.

    Example:
        >>> livelier = bg.break_colors(strokes, 0.05)
        >>> bool((livelier.sh != strokes.sh).any())
        True
    """
    for name, value in (("lightness", lightness), ("chroma", chroma)):
        if not 0 <= value <= MOST:
            raise ValueError(f"break_colors: {name} must be in [0, {MOST}], got {value:g}")
    if not 0 <= follows <= 1:
        raise ValueError(f"break_colors: follows must be in [0, 1], got {follows:g}")
    seed = operator.index(seed)
    if not 0 <= seed <= MAX_SEED:
        raise ValueError(f"break_colors: seed must be in 0 to {MAX_SEED}, got {seed}")
    if len(strokes) == 0 or lightness == chroma == 0:
        return strokes
    sh = strokes.sh.copy()
    columns = {
        name: np.ascontiguousarray(getattr(strokes, name)) for name in ("means", "scales", "opacities")
    }
    _core.break_colors(
        **columns,
        cones_from_rgb=CONES_FROM_RGB,
        lab_from_roots=OKLAB_FROM_ROOTS,
        lightness=lightness,
        chroma=chroma,
        follows=follows,
        seed=seed,
        num_threads=num_threads_or_default(None),
        sh=sh,
    )
    return replace(strokes, sh=sh)
