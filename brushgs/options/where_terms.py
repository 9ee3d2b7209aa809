"""Terms that select parts of a scene: one class per kind, parsed from text.

To add one: write a class with `of` and `__str__`, and add it to `TERMS`.
"""

import re
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from types import MappingProxyType
from typing import ClassVar, Self

from brushgs.options.renamed import current
from brushgs.options.table import Struct

Triple = tuple[float, float, float]
MAX_PARTS = 10_000  # a higher number is a typing error
_NUMBER = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)(e[-+]?[0-9]+)?", re.IGNORECASE)


class _Term(Struct, frozen=True):
    """A kind of term.

    Attributes:
        form: its syntax.
        needs_subject: whether it depends on the first view of the scene.
    """

    form: ClassVar[str]
    needs_subject: ClassVar[bool] = False

    @property
    def kind(self) -> str:
        """The word before the colon."""
        return self.form.partition(":")[0]

    def __str__(self) -> str:
        """Text that parses to this term; the form if it has no values."""
        return self.form


class Box(_Term, frozen=True):
    """An axis-aligned box, its faces included; world units."""

    form: ClassVar[str] = "box:x0,y0,z0,x1,y1,z1"
    low: Triple
    high: Triple

    @classmethod
    def of(cls, text: str) -> Self:
        """Two corners in any order."""
        x0, y0, z0, x1, y1, z1 = _numbers(cls, text, 6)
        return cls((min(x0, x1), min(y0, y1), min(z0, z1)), (max(x0, x1), max(y0, y1), max(z0, z1)))

    def __str__(self) -> str:
        return f"box:{_written(*self.low, *self.high)}"


class Sphere(_Term, frozen=True):
    """A ball, its surface included; world units."""

    form: ClassVar[str] = "sphere:x,y,z,radius"
    center: Triple
    radius: float

    @classmethod
    def of(cls, text: str) -> Self:
        """Center and radius above 0."""
        x, y, z, radius = _numbers(cls, text, 4)
        if not radius > 0:
            raise _wrong(cls, text, "the radius must be above 0")
        return cls((x, y, z), radius)

    def __str__(self) -> str:
        return f"sphere:{_written(*self.center, self.radius)}"


class Half(_Term, frozen=True):
    """The half of space where normal . x >= offset; the normal may have any length."""

    form: ClassVar[str] = "half:nx,ny,nz,d"
    normal: Triple
    offset: float

    @classmethod
    def of(cls, text: str) -> Self:
        """A normal that is not zero, and the offset."""
        x, y, z, offset = _numbers(cls, text, 4)
        if not any((x, y, z)):
            raise _wrong(cls, text, "the normal must not be zero")
        return cls((x, y, z), offset)

    def __str__(self) -> str:
        return f"half:{_written(*self.normal, self.offset)}"


class Color(_Term, frozen=True):
    """Base colors within a Euclidean distance of one, in display-encoded RGB, 0 to 1.

    Attributes:
        color: "#rrggbb", lower case.
        distance: above 0.
    """

    form: ClassVar[str] = "color:#rrggbb,distance"
    color: str
    distance: float

    @property
    def rgb(self) -> Triple:
        """The color as RGB, 0 to 1."""
        red, green, blue = (int(self.color[i : i + 2], 16) / 255 for i in (1, 3, 5))
        return red, green, blue

    @classmethod
    def of(cls, text: str) -> Self:
        """A color, and a distance above 0."""
        color, comma, rest = text.partition(",")
        color = color.strip().lower()
        if not comma or not re.fullmatch(r"#[0-9a-f]{6}", color):
            raise _wrong(cls, text)
        (distance,) = _numbers(cls, rest, 1, text)
        if not distance > 0:
            raise _wrong(cls, text, "the distance must be above 0")
        return cls(color, distance)

    def __str__(self) -> str:
        return f"color:{self.color},{_written(self.distance)}"


class Length(Struct, frozen=True):
    """A length above the ground.

    Attributes:
        value: in world units, or in percent of the subject's height.
        is_percent: whether it is in percent.
    """

    value: float
    is_percent: bool = False

    def __str__(self) -> str:
        return _written(self.value) + "%" * self.is_percent


class Height(_Term, frozen=True):
    """The range between two heights above the ground; one end may be None (open)."""

    form: ClassVar[str] = "height:low..high"
    needs_subject: ClassVar[bool] = True
    low: Length | None
    high: Length | None

    @classmethod
    def of(cls, text: str) -> Self:
        """Two heights in world units, or in % of the subject's height; one may be missing."""
        low, dots, high = text.partition("..")
        if not dots or not (low.strip() or high.strip()):
            raise _wrong(cls, text, "in world units or %, one end may be missing: 10%..50%, 0.2.., ..1.5")
        found = cls(_length(cls, low, text), _length(cls, high, text))
        one, other = found.low, found.high
        is_empty = (
            one is not None
            and other is not None
            and one.is_percent == other.is_percent
            and not one.value < other.value
        )
        if is_empty:
            raise _wrong(cls, text, "low must be below high")
        return found

    def __str__(self) -> str:
        return f"height:{'' if self.low is None else self.low}..{'' if self.high is None else self.high}"


class Subject(_Term, frozen=True):
    """The subject of the scene, without the ground that it stands on."""

    form: ClassVar[str] = "subject"
    needs_subject: ClassVar[bool] = True


class Surroundings(_Term, frozen=True):
    """Everything but the subject: the ground, and what lies around and behind it."""

    form: ClassVar[str] = "surroundings"
    needs_subject: ClassVar[bool] = True


class Part(_Term, frozen=True):
    """A connected part: of the subject by rank in size (1 is the largest), or the one nearest to a point."""

    form: ClassVar[str] = "part:N or part:x,y,z"
    needs_subject: ClassVar[bool] = True
    rank: int | None = None
    point: Triple | None = None

    @classmethod
    def of(cls, text: str) -> Self:
        """A rank of 1 or more, or a point in world units."""
        if "," in text:
            x, y, z = _numbers(cls, text, 3)
            return cls(point=(x, y, z))
        if not re.fullmatch(r"[0-9]{1,9}", text.strip()) or not 1 <= int(text) <= MAX_PARTS:
            raise _wrong(cls, text, f"N must be 1 to {MAX_PARTS:,}, 1 the largest")
        return cls(rank=int(text))

    def __str__(self) -> str:
        return f"part:{self.rank if self.point is None else _written(*self.point)}"


class Mask(_Term, frozen=True):
    """The white parts of painted pictures of the scene: one picture, or a folder of them."""

    form: ClassVar[str] = "mask:FILE|FOLDER"
    path: Path

    @classmethod
    def of(cls, text: str) -> Self:
        """A file or a folder; in quotes if the name contains " and ", " or " or a parenthesis."""
        name = _unquoted(cls, text)
        return cls(Path(name))

    def __str__(self) -> str:
        return f"mask:{_quoted(str(self.path))}"


class Words(_Term, frozen=True):
    """The parts that match words."""

    form: ClassVar[str] = "text:words"
    needs_subject: ClassVar[bool] = True  # seen in views from all around
    words: str

    @classmethod
    def of(cls, text: str) -> Self:
        """Any words; in quotes if they contain " and ", " or " or a parenthesis."""
        return cls(" ".join(_unquoted(cls, text).split()))

    def __str__(self) -> str:
        return f"text:{_quoted(self.words)}"


Term = Box | Sphere | Half | Color | Height | Subject | Surroundings | Part | Mask | Words
# Word before the colon -> term.
TERMS: Mapping[str, type[Term]] = MappingProxyType(
    {
        "box": Box,
        "sphere": Sphere,
        "half": Half,
        "color": Color,
        "height": Height,
        "subject": Subject,
        "surroundings": Surroundings,
        "part": Part,
        "mask": Mask,
        "text": Words,
    }
)
FORMS = tuple(dict.fromkeys(term.form for term in TERMS.values()))


def parse_term(text: str) -> Term:
    """Parse a term such as "sphere:0,0,1,0.5".

    Raises:
        ValueError: if it is invalid; names the text and the expected form.
    """
    name, colon, rest = text.partition(":")
    name = name.strip()
    kind = TERMS.get(current(name.lower()))
    if kind is None:
        raise ValueError(f"where must be of the terms {', '.join(FORMS)}, got {_shown(text)}{_hint(name)}")
    if kind is Subject or kind is Surroundings:
        if colon:
            raise ValueError(f"where must have {kind.form!r} alone, got {_shown(text)}")
        return kind()
    if not rest.strip():
        raise ValueError(f"where must have {kind.form}, got {_shown(text)}")
    return kind.of(rest.strip())  # type: ignore[union-attr]


def _hint(name: str) -> str:
    from difflib import get_close_matches

    words = re.findall(r"[a-z]+", name.lower())
    close = get_close_matches(words[0] if words else "", list(TERMS), n=1)
    return f"; did you mean {TERMS[close[0]].form}?" if close else ""


def _wrong(kind: type[_Term], text: str, rule: str = "") -> ValueError:
    name = kind.form.partition(":")[0]
    return ValueError(
        f"where must have {kind.form}{f' ({rule})' if rule else ''}, got {_shown(f'{name}:{text}')}"
    )


def _shown(text: str) -> str:
    return repr(text if len(text) <= 60 else text[:57] + "...")


def _numbers(kind: type[_Term], text: str, count: int, whole: str | None = None) -> tuple[float, ...]:
    whole = text if whole is None else whole
    words = [word.strip() for word in text.split(",")]
    if len(words) != count:
        raise _wrong(kind, whole)
    return tuple(_number(kind, word, whole) for word in words)


def _number(kind: type[_Term], word: str, whole: str) -> float:
    if not _NUMBER.fullmatch(word) or not isfinite(float(word)):
        raise _wrong(kind, whole, f"{_shown(word)} must be a number")
    return float(word)


def _length(kind: type[_Term], text: str, whole: str) -> Length | None:
    word = text.strip()
    if not word:
        return None
    if word.endswith("%"):
        return Length(_number(kind, word[:-1].strip(), whole), is_percent=True)
    return Length(_number(kind, word, whole))


def _written(*numbers: float) -> str:
    return ",".join(repr(number + 0.0).removesuffix(".0") for number in numbers)


_QUOTED = re.compile(r'"((?:[^"]|"")*)"|\'((?:[^\']|\'\')*)\'')
_PLAIN = re.compile(r"[^\s()\"'](?:[^()\"']*[^\s()\"'])?")
_JOINING = re.compile(r"(^|\s)(and|or|not)(\s|$)", re.IGNORECASE)


def _unquoted(kind: type[_Term], text: str) -> str:
    """Text without its quotes (a doubled quote inside stands for one); other text unchanged."""
    if text[:1] in ('"', "'"):
        match = _QUOTED.fullmatch(text)
        if match is None:
            raise _wrong(kind, text, "one text in quotes, a quote in it doubled")
        quote = text[0]
        text = text[1:-1].replace(quote * 2, quote)
    if not text.strip() or "\0" in text:
        raise _wrong(kind, text, "it must not be empty")
    return text


def _quoted(text: str) -> str:
    is_plain = _PLAIN.fullmatch(text) and not _JOINING.search(text) and "  " not in text
    return text if is_plain else '"' + text.replace('"', '""') + '"'
