"""Focus of stroke density as text: salient parts, the subject, a sphere, or light areas of a picture."""

import re
from math import isfinite
from pathlib import Path

from brushgs.options.table import Struct

FORMS = "auto, off, subject, x,y,z,radius in world units such as 0,1.5,-2,0.4, or a picture file"


class Focus(Struct, frozen=True):
    """Region with higher stroke density: twice as dense, or up to eight times with `is_auto`; the total
    stays.

    At most one of `sphere`, `mask` and `is_auto` is given; without any, the focus is the subject.

    Attributes:
        sphere: (x, y, z, radius), world units, radius > 0.
        mask: picture of the same view as the painting, light in the focus, see
            `brushgs.passes.reduce.focus.mask_focus`.
        is_auto: focus on salient regions, see `brushgs.passes.form.saliency`.

    Raises:
        ValueError: if more than one is given.
    """

    sphere: tuple[float, float, float, float] | None = None
    mask: Path | None = None
    is_auto: bool = False

    def __post_init__(self) -> None:
        if (self.sphere is not None) + (self.mask is not None) + self.is_auto > 1:
            raise ValueError("focus must be one of a sphere, a mask and auto, got more")

    @classmethod
    def of(cls, text: str) -> "Focus | None":
        """Parse "auto", "subject", "x,y,z,radius" or a file name; None for "off".

        Raises:
            ValueError: if it is none of these.
        """
        if text == "off":
            return None
        if text in ("auto", "subject"):
            return cls(is_auto=text == "auto")
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
        if self.mask is not None:
            return str(self.mask)
        return "auto" if self.is_auto else "subject"
