"""Where more strokes go, as text: the subject, a sphere, or the light part of a picture."""

import re
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

FORMS = "subject, x,y,z,radius in world units such as 0,1.5,-2,0.4, or a picture file"


@dataclass(frozen=True)
class Focus:
    """Where twice as many strokes go to an area, out of the same number.

    At most one of `sphere` and `mask` is given; without both it is the subject of the scene.

    Attributes:
        sphere: (x, y, z, radius), world units, the radius above 0.
        mask: picture in the place of the painting, light where the focus is, see
            `brushgs.passes.focus.mask_focus`.
    """

    sphere: tuple[float, float, float, float] | None = None
    mask: Path | None = None

    @classmethod
    def of(cls, text: str) -> "Focus":
        """The focus that is "subject", "x,y,z,radius" or the name of a file.

        Raises:
            ValueError: if it is none of them.
        """
        if text == "subject":
            return cls()
        words = [word.strip() for word in text.split(",")]
        if len(words) == 1 or not all(re.fullmatch(r"[-+.0-9einfa]*", word.lower()) for word in words):
            if not text.strip():
                raise ValueError(f"focus must be {FORMS}, got {text!r}")
            return cls(mask=Path(text))
        try:
            x, y, z, radius = map(float, words)
        except ValueError:
            raise ValueError(f"focus must be {FORMS}, got {text!r}") from None
        if not (all(map(isfinite, (x, y, z, radius))) and radius > 0):
            raise ValueError(f"focus must be four finite numbers, the radius above 0, got {text!r}")
        return cls(sphere=(x, y, z, radius))

    def __str__(self) -> str:
        if self.sphere is not None:
            return ",".join(f"{number:g}" for number in self.sphere)
        return "subject" if self.mask is None else str(self.mask)
