"""What the numbers of a scene file mean, where its writer did not follow the standard layout.

Some exporters store scales and opacities directly in place of their logarithms and logits, rotations as
x, y, z, w, or plain RGB in place of spherical harmonics. The file does not state it: the caller must, or
`brushgs doctor`, which detects it from the numbers.
"""

from dataclasses import dataclass
from typing import Literal, get_args

Scales = Literal["log", "linear"]
Opacities = Literal["logit", "linear", "byte"]
Quats = Literal["wxyz", "xyzw"]
Colors = Literal["sh", "rgb", "byte"]
_WORDS = {"scales": Scales, "opacities": Opacities, "quats": Quats, "colors": Colors}


@dataclass(frozen=True)
class Encoding:
    """What the columns of a file hold. The defaults are the standard layout, which trainers write.

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
        for name, words in _WORDS.items():
            value, known = getattr(self, name), get_args(words)
            if value not in known:
                raise ValueError(f"Encoding: {name} must be one of {', '.join(known)}, got {value!r}")

    @property
    def is_standard(self) -> bool:
        """Whether this is the standard layout."""
        return self == STANDARD


STANDARD = Encoding()
Reading = Encoding  # the former public name, kept for callers
