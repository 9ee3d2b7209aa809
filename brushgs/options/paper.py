"""Sizes on paper: "A3@300", "40x30cm@200", "letter-portrait@150", and in pixels "7680x4320@300".

Only the standard library and msgspec are imported.
"""

import re
from collections.abc import Mapping
from typing import Literal, Self

import msgspec

from brushgs.options.choices import size_rule
from brushgs.options.table import Options, listed

MM_PER_INCH = 25.4
MM_OF: Mapping[str, float] = {"mm": 1.0, "cm": 10.0, "in": MM_PER_INCH}
# Shorter and longer side, mm: ISO 216, and ANSI Y14.1.
SHEETS: Mapping[str, tuple[float, float]] = {
    "A0": (841, 1189),
    "A1": (594, 841),
    "A2": (420, 594),
    "A3": (297, 420),
    "A4": (210, 297),
    "A5": (148, 210),
    "A6": (105, 148),
    "B0": (1000, 1414),
    "B1": (707, 1000),
    "B2": (500, 707),
    "B3": (353, 500),
    "B4": (250, 353),
    "B5": (176, 250),
    "B6": (125, 176),
    "letter": (8.5 * MM_PER_INCH, 11 * MM_PER_INCH),
    "legal": (8.5 * MM_PER_INCH, 14 * MM_PER_INCH),
    "tabloid": (11 * MM_PER_INCH, 17 * MM_PER_INCH),
}
LEAST_DPI, MOST_DPI = 10.0, 2400.0
EXAMPLES = "A3@300, A4-portrait@300, letter@150, 40x30cm@200 or 7680x4320@300"
_NUMBER = r"([0-9]{1,6}(?:\.[0-9]{1,6})?)"
_SHEET = re.compile(rf"([a-z]+[0-9]?)(?:-(portrait|landscape))?@{_NUMBER}", re.IGNORECASE)
_SIDES = re.compile(rf"{_NUMBER}x{_NUMBER} ?(mm|cm|in|px)?@{_NUMBER}", re.IGNORECASE)
Turn = Literal["", "portrait", "landscape"]


class PaperSize(Options, frozen=True):
    """The size of a picture on paper.

    Attributes:
        sides: width and height as they lie, mm, > 0.
        dpi: pixels per inch.
        text: as it was written, without the resolution.
        is_free: whether the subject may turn the paper, which then lies across.
    """

    sides: tuple[float, float]
    dpi: float
    text: str
    is_free: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if not LEAST_DPI <= self.dpi <= MOST_DPI:
            raise ValueError(f"size must have {LEAST_DPI:g} to {MOST_DPI:g} dpi, got {self}")
        if broken := size_rule(*self.pixels):
            raise ValueError(f"size {broken}; take fewer dpi than {self}")

    @classmethod
    def of(cls, text: str) -> Self:
        """Parse a size.

        Raises:
            ValueError: if it is no size on paper; the message starts with "must".
        """
        if match := _SIDES.fullmatch(text):
            width, height, unit, dpi = match.groups()
            unit = "" if unit is None or unit.lower() == "px" else unit.lower()
            mm = MM_OF[unit] if unit else MM_PER_INCH / max(float(dpi), 1e-9)  # without a unit: pixels
            return cls((float(width) * mm, float(height) * mm), float(dpi), f"{width}x{height}{unit}")
        match = _SHEET.fullmatch(text)
        names = {name.lower(): name for name in SHEETS}
        if match is None or match[1].lower() not in names:
            raise ValueError(f"must be a size on paper such as {EXAMPLES}, got {text!r}")
        name, turn = names[match[1].lower()], (match[2] or "").lower()
        short, long = SHEETS[name]
        sides = (short, long) if turn == "portrait" else (long, short)
        return cls(sides, float(match[3]), f"{name}-{turn}" if turn else name, is_free=not turn)

    def __str__(self) -> str:
        return f"{self.text}@{self.dpi:g}"

    @property
    def pixels(self) -> tuple[int, int]:
        """(width, height) of the picture."""
        width, height = (max(round(side / MM_PER_INCH * self.dpi), 1) for side in self.sides)
        return width, height

    @property
    def turns(self) -> "tuple[PaperSize, ...]":
        """How the paper may lie: one way, or across and upright."""
        if not self.is_free:
            return (self,)
        replace = msgspec.structs.replace
        across = replace(self, text=f"{self.text}-landscape", is_free=False)
        upright = replace(across, sides=self.sides[::-1], text=f"{self.text}-portrait")
        return across, upright


def sheet_names() -> str:
    """The sheets in words, for help."""
    return listed(["A0 to A6", "B0 to B6", *(name for name in SHEETS if name.islower())])
