"""Styles by name and share, and changes of colour that need no style: what an artist turns."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from brushgs.options.choices import STYLE_SUFFIX
from brushgs.options.look_parts import Within, _Part

MAX_STYLES = 8  # of one painting
FORM = "FILE:SHARE, several with commas between them, such as " + ",".join(
    (f"monet{STYLE_SUFFIX}:0.7", f"dusk{STYLE_SUFFIX}:0.3")
)
ROUNDING = 1e-9
NUMBERS = ("brightness", "contrast", "saturation", "temperature")


@dataclass(frozen=True)
class StyleShare:
    """One style of a mix.

    Attributes:
        file: that holds it.
        share: 0 to 1.
    """

    file: Path
    share: float


@dataclass(frozen=True)
class StyleConfig:
    """The styles of a painting: what is missing of 1 in their shares is the painting without any.

    Attributes:
        styles: 1 to 8.
        has_brushes: whether strokes take the brushes of styles that have some.
    """

    styles: tuple[StyleShare, ...]
    has_brushes: bool = True

    def __post_init__(self) -> None:
        if not 1 <= len(self.styles) <= MAX_STYLES:
            raise ValueError(f"style must be 1 to {MAX_STYLES} styles, got {len(self.styles)}")
        for style in self.styles:
            if not 0 <= style.share <= 1:
                found = f"{style.share:g}"
                cure = f"; for {found} % write {style.share / 100:g}" if 1 < style.share <= 100 else ""
                raise ValueError(f"style must have shares of 0 to 1, got {found}{cure}")
        if self.share > 1 + ROUNDING:
            raise ValueError(f"style must have shares that add up to at most 1, got {self.share:g}")

    @property
    def share(self) -> float:
        """Of all styles together: 0 is the painting without them, 1 with nothing of its own."""
        return sum(style.share for style in self.styles)

    @property
    def files(self) -> tuple[Path, ...]:
        """Of the styles."""
        return tuple(style.file for style in self.styles)

    @classmethod
    def parse(cls, text: str) -> "StyleConfig":
        """Parse a text such as "monet.style:0.7,dusk.style:0.3"; without a share it is 1.

        Raises:
            ValueError: if it has no such form, or a share is out of range.
        """
        styles = []
        for word in text.split(","):
            name, colon, share = word.strip().rpartition(":")
            if not colon or not _is_number(share):
                name, share = word.strip(), "1"
            if not name:
                raise ValueError(f"style must be {FORM}, got {text!r}")
            number = float(share.removesuffix("%")) / (100 if share.endswith("%") else 1)
            styles.append(StyleShare(Path(name), number))
        return cls(tuple(styles))

    def __str__(self) -> str:
        """The text that `parse` takes."""
        return ",".join(f"{style.file}:{style.share:g}" for style in self.styles)


def _is_number(text: str) -> bool:
    return re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?%?", text.lower()) is not None


def check_swap(text: str) -> str:
    """The text, if it is a swap of colours.

    Raises:
        ValueError: if it is none.
    """
    if not re.fullmatch(r"#[0-9a-fA-F]{6}:#[0-9a-fA-F]{6}", text):
        raise ValueError(f"swap must be two colours such as '#3a5f0b:#7a1f1f', got {text!r}")
    return text


@dataclass(frozen=True)
class AdjustConfig(_Part):
    """Changes of the colours of strokes, the last of all; the defaults change nothing.

    Attributes:
        brightness: added to each channel, -1 to 1.
        contrast: factor of the distance from middle grey, 0 to 3.
        saturation: factor of the distance from grey of the same luminance, 0 (grey) to 3.
        temperature: -1 (blue) to 1 (orange).
        swaps: pairs "#rrggbb:#rrggbb": colours near the first move to the second.
    """

    brightness: Annotated[float, Within(-1, 1)] = 0.0
    contrast: Annotated[float, Within(0, 3)] = 1.0
    saturation: Annotated[float, Within(0, 3)] = 1.0
    temperature: Annotated[float, Within(-1, 1)] = 0.0
    swaps: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        for swap in self.swaps:
            check_swap(swap)

    @classmethod
    def parse(cls, text: str) -> dict[str, float]:
        """The numbers of a text such as "saturation=0.6,contrast=1.1", by field.

        Raises:
            ValueError: if it has no such form, or a number is out of range.
        """
        numbers = {}
        for word in text.split(","):
            name, equals, number = (part.strip() for part in word.partition("="))
            if name not in NUMBERS or not equals or not _is_number(number):
                names = ", ".join(NUMBERS)
                raise ValueError(f"adjust must be {names} = a number, such as saturation=0.6, got {word!r}")
            numbers[name] = float(number.removesuffix("%")) / (100 if number.endswith("%") else 1)
        cls(**numbers)  # type: ignore[arg-type]  # checks them
        return numbers

    @property
    def changes(self) -> bool:
        """Whether it does anything."""
        return self != AdjustConfig()
