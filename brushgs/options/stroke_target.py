"""How many strokes: a count, a share, a size of strokes, or an error to the plain picture."""

import re
from collections.abc import Mapping
from typing import Any, get_args

from brushgs.options.choices import MAX_SIDE, Knee
from brushgs.options.paper import MM_PER_INCH
from brushgs.options.table import Options, number, shown

MAX_PSNR = 100.0  # dB; 16-bit pictures reach no more


class ErrorBudget(Options, frozen=True):
    """A stroke count chosen by error: the fewest strokes that reach a PSNR to the plain picture.

    `psnr` is in dB, above 0 and at most 100.
    """

    psnr: float

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.psnr <= MAX_PSNR:
            raise ValueError(f"strokes must be above 0 dB and at most {MAX_PSNR:g} dB, got {self.psnr:g} dB")

    def __str__(self) -> str:
        return f"{self.psnr:g}dB"


class StrokeSize(Options, frozen=True):
    """A stroke count chosen by typical stroke length, see `brushgs.stroke_count.view_model.typical_size`.

    `pixels` is above 0, at most the longest possible side of a picture. With `is_mm` it counts millimeters on
    paper instead.
    """

    pixels: float
    is_mm: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.pixels <= MAX_SIDE:
            unit = "mm" if self.is_mm else "px"
            raise ValueError(f"stroke-size must be above 0 and at most {MAX_SIDE} {unit}, got {self}")

    def __str__(self) -> str:
        return f"{self.pixels:g}{'mm' if self.is_mm else 'px'}"

    def at(self, dpi: float | None) -> "StrokeSize":
        """The size in pixels.

        Raises:
            ValueError: if it is in millimeters and there is no size on paper.
        """
        if not self.is_mm:
            return self
        if dpi is None:
            cure = "give one, such as --size A3@300, or the stroke size in px"
            raise ValueError(f"stroke-size must be in px without a size on paper, got {self}; {cure}")
        return StrokeSize(self.pixels / MM_PER_INCH * dpi)


class UsualCount(Options, frozen=True):
    """The stroke count of a look, not chosen by the user; stroke files keep all their strokes."""

    count: int

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.count < 1:
            raise ValueError(f"strokes must be a count >= 1, got {self.count}")

    def __str__(self) -> str:
        return str(self.count)


StrokeTarget = Knee | ErrorBudget | StrokeSize  # criteria for choosing a stroke count
KNEES: Mapping[str, Knee] = {knee: knee for knee in get_args(Knee)}


def parse_strokes(text: str) -> int | float | Knee | ErrorBudget | None:
    """A value of `ClusterConfig.strokes`: int for a count, float for a share, None for all.

    Args:
        text: a count such as "7000", a share such as "10%", "all", "auto" or "auto:frame", or a PSNR such as
            "24dB".

    Raises:
        ValueError: if it is none of these, or out of range.
    """
    if text == "all":
        return None
    if text in KNEES:
        return KNEES[text]
    if text.lower().endswith("db") and (decibels := _number(text[:-2])) is not None:
        return ErrorBudget(decibels)
    if text.endswith("%") and (percent := _number(text[:-1])) is not None:
        if not 0 < percent <= 100:
            raise ValueError(f"strokes must be above 0 % and at most 100 %, got {text!r}")
        return percent / 100
    if re.fullmatch(r"\+?[0-9]{1,18}", text) and int(text) >= 1:
        return int(text)
    raise ValueError(
        "strokes must be a count of 1 or more, a share such as 10%, all, auto, or a PSNR such as 24dB, got "
        f"{text!r}"
    )


def _number(text: str) -> float | None:
    try:
        return number(text)
    except ValueError:
        return None


def strokes_value(given: Any) -> int | ErrorBudget | StrokeSize | UsualCount:
    """A number of strokes from Python: a count, or a ready-made target."""
    if isinstance(given, ErrorBudget | StrokeSize | UsualCount):
        return given
    if isinstance(given, bool) or not hasattr(given, "__index__") or given < 1:
        raise ValueError(
            "must be a count of 1 or more, a share such as '10%', all, auto, or a PSNR such as '24dB', got "
            f"{shown(given)}"
        )
    return int(given)


def size_from_text(text: str) -> StrokeSize:
    """Parse a typical stroke length in millimeters or pixels; the unit of pixels is optional."""
    match = re.fullmatch(r"([0-9]+\.?[0-9]*|\.[0-9]+) ?(px|mm)?", text, re.IGNORECASE)
    if match is None:
        raise ValueError(f"must be a length above 0 such as 24px, or 8mm on paper, got {text!r}")
    return StrokeSize(float(match[1]), is_mm=(match[2] or "").lower() == "mm")


def size_value(given: Any) -> StrokeSize:
    """A typical stroke length from Python: text as for `size_from_text`, or a ready-made one."""
    return given if isinstance(given, StrokeSize) else size_from_text(str(given))
