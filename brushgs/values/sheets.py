"""Layers of a painting for painting programs, each composited on those below it."""

from dataclasses import dataclass
from typing import Literal

from brushgs.values.arrays import Array

LEAST = 0.5 / 255  # least alpha or light that 8 bits can represent
Mix = Literal["src-over", "multiply", "color-dodge", "plus"]  # names of SVG, without the prefix


@dataclass(frozen=True, eq=False)
class Sheet:
    """One layer.

    Attributes:
        name: of the layer.
        rgb: [H, W, 3] color premultiplied by alpha, display-encoded.
        alpha: [H, W] 0 to 1.
        mix: blend mode on the layers below. Source: W3C, Compositing and Blending Level 1.
    """

    name: str
    rgb: Array  # [H, W, 3]
    alpha: Array  # [H, W]
    mix: Mix = "src-over"
