"""The layers of a painting for painting programs: each is laid on those below it."""

from dataclasses import dataclass
from typing import Literal

from brushgs.values.arrays import Array

LEAST = 0.5 / 255  # alpha or light that 8 bits hold
Mix = Literal["src-over", "multiply", "color-dodge", "plus"]  # names of SVG, without its prefix


@dataclass(frozen=True, eq=False)
class Sheet:
    """One layer.

    Attributes:
        name: of the layer.
        rgb: [H, W, 3] colour premultiplied by alpha, display-encoded.
        alpha: [H, W] 0 to 1.
        mix: how it is laid on the layers below. Source: W3C, Compositing and Blending Level 1.
    """

    name: str
    rgb: Array  # [H, W, 3]
    alpha: Array  # [H, W]
    mix: Mix = "src-over"
