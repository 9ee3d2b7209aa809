"""A part of a scene as text: the Gaussians in a box, in a sphere, or near a colour."""

import re
from dataclasses import dataclass
from math import isfinite

FORMS = {
    "box": (6, "box:x0,y0,z0,x1,y1,z1"),
    "sphere": (4, "sphere:x,y,z,radius"),
    "colour": (2, "colour:#rrggbb,distance"),
}


@dataclass(frozen=True)
class Region:
    """A part of a scene.

    Attributes:
        kind: "box" (two corners in any order), "sphere" (centre and radius) or "colour" (display-encoded RGB,
            0 to 1, and the maximum Euclidean distance of base colours from it).
        numbers: 6, 4 and 4 of them; world units except for colours.
    """

    kind: str
    numbers: tuple[float, ...]

    @classmethod
    def parse(cls, text: str) -> "Region":
        """Parse a region such as "sphere:0,0,1,0.5".

        Raises:
            ValueError: if the text does not have one of the `FORMS`.
        """
        kind, _, rest = text.partition(":")
        words = [word.strip() for word in rest.split(",")]
        if kind not in FORMS or len(words) != FORMS[kind][0]:
            raise ValueError(f"region must be {', '.join(form for _, form in FORMS.values())}, got {text!r}")
        if kind == "colour":
            if not re.fullmatch(r"#[0-9a-fA-F]{6}", words[0]):
                raise ValueError(f"the colour of a region must be #rrggbb, got {words[0]!r}")
            words[:1] = [str(int(words[0][i : i + 2], 16) / 255) for i in (1, 3, 5)]
        numbers = tuple(_number(word) for word in words)
        if kind != "box" and not numbers[-1] > 0:
            raise ValueError(f"the last number of {FORMS[kind][1]} must be above 0, got {words[-1]}")
        return cls(kind, numbers)


def _number(word: str) -> float:
    try:
        number = float(word)
    except ValueError:
        number = float("nan")
    if not isfinite(number):
        raise ValueError(f"{word!r} must be a number")
    return number
