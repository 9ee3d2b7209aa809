"""Styles with their shares, and color adjustments that need no style."""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar

from brushgs.options.choices import STYLE_SUFFIX
from brushgs.options.table import (
    NestedError,
    Options,
    hint_for,
    in_files,
    option,
    read_table,
    rows_of,
    shown,
)

MAX_STYLES = 8  # per painting
FORM = "FILE:SHARE, several with commas between them, such as " + ",".join(
    (f"monet{STYLE_SUFFIX}:0.7", f"dusk{STYLE_SUFFIX}:0.3")
)
ROUNDING = 1e-9
DIALS = ("color", "marks", "direction", "line", "stage")  # properties of a style, each with its share
NUMBERS = ("brightness", "contrast", "saturation", "temperature")


class StyleShare(Options, frozen=True):
    """One style of a mix: its share, and for each property the part of this share that is used, 0 to 1.

    The properties are its colors; size, shape and brushes of its marks; their directions; its contours; and
    the surroundings of its subject.
    """

    file: Path
    share: float
    color: float = 1.0
    marks: float = 1.0
    direction: float = 1.0
    line: float = 1.0
    stage: float = 1.0

    @classmethod
    def parse(cls, text: str) -> "StyleShare":
        """Parse a text such as "monet.style:0.8;marks=0.7;line=0"."""
        start, *dials = (part.strip() for part in text.split(";"))
        name, colon, share = start.rpartition(":")
        if not colon or not _is_number(share):
            name, share = start, "1"
        if not name:
            raise ValueError(f"style must be {FORM}, got {text!r}")
        return cls(Path(name), _number(share), **dict(_dial(dial) for dial in dials))

    @property
    def dials(self) -> dict[str, float]:
        """The properties with a value other than 1."""
        return {name: getattr(self, name) for name in DIALS if getattr(self, name) != 1}

    def __str__(self) -> str:
        """The text that `parse` takes."""
        return ";".join(
            [f"{self.file}:{self.share:g}", *(f"{name}={at:g}" for name, at in self.dials.items())]
        )


def _check_dials(names: Iterable[str], known: tuple[str, ...]) -> None:
    for name in names:
        if name not in known:
            rule = f"style must have properties among {', '.join(known)}"
            raise ValueError(f"{rule}, got {shown(name)}{hint_for(name, known)}")


def _dial(text: str) -> tuple[str, float]:
    name, equals, number = (part.strip() for part in text.partition("="))
    _check_dials([name], DIALS)
    if not equals or not _is_number(number):
        raise ValueError(f"style must have properties such as {name}=0.7, got {text!r}")
    return name, _number(number)


def _number(text: str) -> float:
    return float(text.removesuffix("%")) / (100 if text.endswith("%") else 1)


def _styles(text: str) -> tuple[StyleShare, ...]:
    return StyleConfig.parse(text).styles


def _styles_value(given: Any) -> tuple[StyleShare, ...]:
    """Styles from a table of file -> share, or from one path."""
    if isinstance(given, Mapping) and given:
        return tuple(_share_of(Path(file), share) for file, share in given.items())
    if isinstance(given, Path):
        return (StyleShare(given, 1.0),)
    if isinstance(given, str):
        return _styles(given)
    raise ValueError(f"must be {FORM}, got {shown(given)}")


def _share_of(file: Path, given: Any) -> StyleShare:
    """One style of a table; `given` is its share, or a table of share and properties."""
    if not isinstance(given, Mapping):
        return StyleShare(file, float(given))
    _check_dials(given, ("share", *DIALS))
    return StyleShare(file, **{"share": 1.0, **{name: float(number) for name, number in given.items()}})


class StyleConfig(Options, frozen=True):
    """The styles of a painting; if their shares add up to less than 1, the rest is painted without style.

    `has_brushes`: whether strokes use the brushes of the styles.
    """

    GROUP: ClassVar = "style"
    ABOUT: ClassVar = (
        "styles learned from paintings or edits (`brushgs style` learns one), and color adjustments"
    )
    # fmt: off
    styles: Annotated[tuple[StyleShare, ...], option("style, or several with commas: "
        f"monet{STYLE_SUFFIX}:0.7,dusk{STYLE_SUFFIX}:0.3; shares add up to at most 1, what is missing is "
        f"the painting without style; behind semicolons how far it takes {', '.join(DIALS)}, such as "
        f"monet{STYLE_SUFFIX}:0.8;marks=0.7;line=0 #learned #artist #transfer", flag="--style",
        default="none, without a share 1", metavar="FILE:SHARE", read=_styles, make=_styles_value,
        written=(",", ":"), example="monet.style:0.7")]
    # fmt: on
    has_brushes: bool = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 1 <= len(self.styles) <= MAX_STYLES:
            raise ValueError(f"style must be 1 to {MAX_STYLES} styles, got {len(self.styles)}")
        for style in self.styles:
            for name in ("share", *DIALS):
                number = getattr(style, name)
                if not 0 <= number <= 1:
                    what = "shares" if name == "share" else name
                    cure = f"; for {number:g} % write {number / 100:g}" if 1 < number <= 100 else ""
                    raise ValueError(f"style must have {what} of 0 to 1, got {number:g}{cure}")
        if self.share > 1 + ROUNDING:
            raise ValueError(f"style must have shares that add up to at most 1, got {self.share:g}")

    @property
    def share(self) -> float:
        """Sum of all shares: 0 is the painting without style, 1 is style only."""
        return sum(style.share for style in self.styles)

    @property
    def files(self) -> tuple[Path, ...]:
        """The style files."""
        return tuple(style.file for style in self.styles)

    @property
    def only(self) -> Path | None:
        """The file of a single style that is taken wholly; None for others."""
        first = self.styles[0]
        return first.file if len(self.styles) == 1 and first.share == 1 and not first.dials else None

    @classmethod
    def parse(cls, text: str) -> "StyleConfig":
        """Parse a text such as "monet.style:0.7,dusk.style:0.3"; without a share it is 1.

        Raises:
            ValueError: if the text is invalid, or a share is out of range.
        """
        return cls(tuple(StyleShare.parse(word) for word in text.split(",")))

    def __str__(self) -> str:
        """The text that `parse` takes."""
        return ",".join(map(str, self.styles))


def _is_number(text: str) -> bool:
    return re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?%?", text.lower()) is not None


def style_config(given: Any) -> StyleConfig:
    """Styles of a text, a file or a table of files with their shares."""
    return given if isinstance(given, StyleConfig) else StyleConfig(_styles_value(given))


def check_swap(text: Any) -> str:
    """Check a color swap and return it.

    Raises:
        ValueError: if it is not "#rrggbb:#rrggbb".
    """
    if not isinstance(text, str) or not re.fullmatch(r"#[0-9a-fA-F]{6}:#[0-9a-fA-F]{6}", text):
        raise ValueError(f"swap must be two colors such as '#3a5f0b:#7a1f1f', got {text!r}")
    return text


def _adjustments(text: str) -> dict[str, float]:
    """Parse "saturation=0.6,contrast=1.1" to numbers by field.

    Raises:
        ValueError: if the text is invalid, or a number is out of range.
    """
    numbers = {}
    for word in text.split(","):
        name, equals, number = (part.strip() for part in word.partition("="))
        if name not in NUMBERS or not equals or not _is_number(number):
            names = ", ".join(NUMBERS)
            raise ValueError(f"must be {names} = a number, such as saturation=0.6, got {word!r}")
        numbers[name] = float(number.removesuffix("%")) / (100 if number.endswith("%") else 1)
    return _checked_adjustments(numbers)


def _checked_adjustments(given: Any) -> dict[str, float]:
    """The same from a table of Python or TOML."""
    rows = {row.field: row for row in rows_of(AdjustConfig) if row.field in NUMBERS}
    if not isinstance(given, Mapping):
        raise ValueError(f"must be a table such as {{saturation = 0.6}}, got {shown(given)}")
    try:
        found = read_table(given, rows)
        AdjustConfig(**found)
    except ValueError as error:
        raise NestedError(str(error)) from None
    return found


class AdjustFlag(Options, frozen=True):
    """`--adjust`, one flag for several numbers of `AdjustConfig`."""

    GROUP: ClassVar = "style"
    # fmt: off
    numbers: Annotated[dict[str, float] | None, option("one or several, separated by commas: brightness -1 "
        "to 1 (default 0), contrast and saturation 0 to 3 (default 1), temperature -1 (blue) to 1 (orange, "
        "default 0); applied after palette and style #brightness #contrast #saturation #temperature "
        "#exposure",
        flag="--adjust", default="", metavar="NAME=NUMBER", read=_adjustments, make=_checked_adjustments,
        action="fields", written=(",", "="))] = None
    # fmt: on


def _swaps(given: Any) -> tuple[str, ...]:
    return tuple(check_swap(one) for one in given)


class AdjustConfig(Options, frozen=True):
    """Final color adjustments of strokes; the defaults change nothing."""

    GROUP: ClassVar = "style"
    # fmt: off
    brightness: Annotated[float, in_files("added to each channel", ge=-1, le=1)] = 0.0
    contrast: Annotated[float, in_files("factor of the distance from middle grey", ge=0, le=3)] = 1.0
    saturation: Annotated[float, in_files("factor of the distance from grey of the same luminance, 0 is "
        "grey", ge=0, le=3)] = 1.0
    temperature: Annotated[float, in_files("-1 is blue, 1 orange", ge=-1, le=1)] = 0.0
    swaps: Annotated[tuple[str, ...], option("move colors near #a to #b, such as '#3a5f0b:#7a1f1f'; "
        "repeatable #replace #color #recolor", flag="--swap", default="none", metavar="#a:#b",
        read=check_swap, make=_swaps, action="append")] = ()
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        _swaps(self.swaps)

    @property
    def changes(self) -> bool:
        """Whether any value differs from the defaults."""
        return self != AdjustConfig()
