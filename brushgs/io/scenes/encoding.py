"""How the numbers of a scene file are to be read, where its writer did not follow the usual layout.

Some exporters store scales and opacities as they are in place of their logarithms and logits, rotations
as x, y, z, w, or plain RGB in place of spherical harmonics. Nothing in the file says so: whoever loads it
must, or `brushgs doctor`, which looks at the numbers.
"""

from dataclasses import dataclass
from typing import Literal, Protocol, get_args

import numpy as np

from brushgs.arrays import F32
from brushgs.sh import C0

Scales = Literal["log", "linear"]
Opacities = Literal["logit", "linear", "byte"]
Quats = Literal["wxyz", "xyzw"]
Colors = Literal["sh", "rgb", "byte"]

# An opacity of 1 that passed through other arithmetic may lie this far above 1; more is no opacity.
OPACITY_SLACK = 1e-3


class Block(Protocol):
    """Raw values of some rows: `Columns` before `activate`."""

    quats: F32
    scales: F32
    opacities: F32
    sh: F32


@dataclass(frozen=True)
class Encoding:
    """What the columns of a file hold. The defaults are the usual layout.

    Attributes:
        scales: "log" for natural logarithms, "linear" for standard deviations in world units.
        opacities: "logit", "linear" for 0 to 1, "byte" for 0 to 255.
        quats: the order of rot_0 to rot_3.
        colors: what f_dc holds: "sh" for coefficients, "rgb" for display-encoded 0 to 1, "byte" for 0 to 255.

    Raises:
        ValueError: if a word is none of these.
    """

    scales: Scales = "log"
    opacities: Opacities = "logit"
    quats: Quats = "wxyz"
    colors: Colors = "sh"

    def __post_init__(self) -> None:
        for name, words in (
            ("scales", Scales),
            ("opacities", Opacities),
            ("quats", Quats),
            ("colors", Colors),
        ):
            value = getattr(self, name)
            if value not in get_args(words):
                raise ValueError(
                    f"Reading: {name} must be one of {', '.join(get_args(words))}, got {value!r}"
                )

    @property
    def is_standard(self) -> bool:
        """Whether this is the layout that trainers write."""
        return self == Encoding()

    def standardize(self, block: Block) -> None:
        """Turn raw values into those of the usual layout, in place.

        What cannot be one (a negative scale, an opacity outside 0 to 1) becomes NaN, which is found and
        left out like any other. A scale of 0 becomes -infinity, opacities of 0 and 1 become infinite: right.
        """
        with np.errstate(all="ignore"):
            if self.scales == "linear":
                np.log(block.scales, out=block.scales)
            if self.opacities != "logit":
                if self.opacities == "byte":
                    block.opacities /= 255
                above = (block.opacities > 1) & (block.opacities <= 1 + OPACITY_SLACK)
                block.opacities[above] = 1
                block.opacities[:] = np.log(block.opacities) - np.log1p(-block.opacities)
            if self.quats == "xyzw":
                block.quats[:] = block.quats[:, [3, 0, 1, 2]]
            if self.colors != "sh":
                full = 255 if self.colors == "byte" else 1
                block.sh[:, 0] = (block.sh[:, 0] / full - 0.5) / C0


STANDARD = Encoding()
Reading = Encoding  # its public name before it was called what it is
