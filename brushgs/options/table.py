"""The option table: one line per option (type, words, range, flag) from which all else is derived.

    class LightConfig(Options, frozen=True):
        relief: Annotated[float, share("strength of light and shade on the paint")] = 0.0

The rows of a class (`rows_of`) give its flags and help, parsing of text, files and Python keywords, range
checks of the constructor, manifests, and the controls of the page of `brushgs view`.
"""

import sys
from collections.abc import Callable, Iterable, Mapping
from functools import cache, cached_property
from math import degrees, isfinite, radians
from pathlib import Path
from types import UnionType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Union, get_args, get_origin

from brushgs.options.renamed import current

_IS_SLOW = "typing_extensions" not in sys.modules
if _IS_SLOW:  # msgspec imports typing_extensions (50 ms) for names that typing has as well
    sys.modules["typing_extensions"] = None  # type: ignore[assignment]
try:
    import msgspec
    from msgspec import Struct
finally:
    if _IS_SLOW:
        del sys.modules["typing_extensions"]

if TYPE_CHECKING:
    from dataclasses import Field

__all__ = ["Struct"]  # re-export, beside the definitions here

LARGEST = 1e300  # limit for magnitudes of numbers from files
OF_FILMS = "belongs to films; use `brushgs render`, or brushgs.paint_film"
OF_FILES = "belongs to files; use `brushgs render`, or brushgs.save(frame, ...)"
OF_COMMANDS = "belongs to the command; give report="
OF_SCENE_FILES = "belongs to scene files; omit it with Gaussians, which are in memory"


class Option(Struct, frozen=True, kw_only=True):
    """Properties of an option beside its type and default.

    Attributes:
        words: help text without range and default, followed by #tags for search. {pictures} and the like are
            replaced by lists of formats.
        flag: its flags; "" derives one from the field name; None: no flag, only in files and Python.
        ge: lower bound, with `gt`, `le` and `lt` likewise; for every number of a tuple; in degrees for
            angles.
        unit: of its numbers. Angles with unit "degrees" are stored in radians.
        default: default in words, if the value itself does not say it.
        metavar: placeholder in help, if not derived from the type.
        read: converts text to a value, or raises ValueError; None: by type.
        make: converts a Python or TOML value that is neither text nor of the type.
        written: separators for writing a list or table as text: between items, and after keys.
        takes_percent: whether 70% means 0.7.
        is_signed: whether text may start with a minus without being a plain number.
        action: argparse action, if it does not store a value.
        nargs: of argparse, as is `const`.
        choices: allowed texts, if not given by the type.
        alone: name of a group of mutually exclusive flags.
        example: value for the short help.
        not_in_memory: why `brushgs.paint` does not take it, and what to use; overrides that of its class.
    """

    words: str = ""
    flag: str | None = ""
    ge: float | None = None
    gt: float | None = None
    le: float | None = None
    lt: float | None = None
    unit: str = ""
    default: str | None = None
    metavar: str = ""
    read: Callable[[str], Any] | None = None
    make: Callable[[Any], Any] | None = None
    written: tuple[str, str] = (",", "")
    takes_percent: bool = False
    is_signed: bool = False
    action: Any = None
    nargs: str | None = None
    const: Any = None
    choices: tuple[str, ...] | None = None
    alone: str = ""
    example: str = ""
    not_in_memory: str = ""

    @property
    def span(self) -> str:
        """Its range in words; "" without limits."""
        low, high = self.gt if self.ge is None else self.ge, self.lt if self.le is None else self.le
        above = "" if low is None else f"above {number_text(low)}"
        if self.ge is not None and self.le is not None:
            span = f"{number_text(self.ge)} to {number_text(self.le)}"
        elif high is not None:
            below = f"{'at most' if self.lt is None else 'below'} {number_text(high)}"
            span = f"{above} and {below}" if above else below
        else:
            span = f"{number_text(self.ge)} or more" if self.ge is not None else above
        return f"{span} {self.unit}" if span and self.unit else span

    def holds(self, number: float) -> bool:
        """Whether a number is finite and in range."""
        return isfinite(number) and (
            (self.ge is None or number >= self.ge)
            and (self.gt is None or number > self.gt)
            and (self.le is None or number <= self.le)
            and (self.lt is None or number < self.lt)
        )


def option(words: str = "", **what: Any) -> Option:
    """An option with a flag, see `Option`."""
    return Option(words=words, **what)


def share(words: str = "", **what: Any) -> Option:
    """An option for a share, 0 to 1 or in percent."""
    limits: dict[str, Any] = {"ge": 0, "le": 1, "takes_percent": True}
    return Option(**limits | {"words": words} | what)


def in_files(words: str = "", **what: Any) -> Option:
    """An option without a flag, only for files and Python."""
    return Option(words=words, flag=None, **what)


class _FieldsOfDataclass:
    """Dataclass fields on demand, so that `dataclasses.replace`, `fields` and `asdict` accept options."""

    def __get__(self, value: object, owner: type["Options"]) -> "dict[str, Field[Any]]":
        from dataclasses import make_dataclass

        made: Any = make_dataclass(owner.__name__, [row.field for row in rows_of(owner)])
        for row in rows_of(owner):
            one = made.__dataclass_fields__[row.field]
            one.type, one.default = row.annotation, row.default
        found: dict[str, Field[Any]] = made.__dataclass_fields__
        return found


class Options(Struct, frozen=True, forbid_unknown_fields=True):
    """Options of one step, checked on construction."""

    GROUP: ClassVar[str] = ""  # help group of its flags
    ABOUT: ClassVar[str] = ""  # description of that group
    IN_LOOKS: ClassVar[bool] = False  # whether looks set the defaults of its flags
    NOT_IN_MEMORY: ClassVar[str] = ""  # why `brushgs.paint` does not take them
    if TYPE_CHECKING:
        __dataclass_fields__: ClassVar[dict[str, Field[Any]]]
    else:
        __dataclass_fields__ = _FieldsOfDataclass()

    def __post_init__(self) -> None:
        for row in rows_of(type(self)):
            row.check(getattr(self, row.field))


class Row:
    """One row of the table: an option of a class."""

    def __init__(self, field: str, annotation: Any, default: Any = None, of: type[Options] = Options) -> None:
        self.field, self.annotation, self.default, self.of = field, annotation, default, of
        is_annotated = get_origin(annotation) is Annotated
        self.kind: Any = get_args(annotation)[0] if is_annotated else annotation
        found = [one for one in getattr(annotation, "__metadata__", ()) if isinstance(one, Option)]
        self.option: Option = found[0] if found else in_files()
        self.words, *self.tags = self.option.words.split(" #")
        self.not_in_memory = self.option.not_in_memory or of.NOT_IN_MEMORY

    def described(self, words: str) -> "Row":
        """The same row with another help text."""
        told = msgspec.structs.replace(self.option, words=words)
        return Row(self.field, Annotated[self.kind, told], self.default, self.of)

    @cached_property
    def kinds(self) -> tuple[Any, ...]:
        """Types of its values, without None."""
        is_union = get_origin(self.kind) in (UnionType, Union)
        return tuple(
            one for one in (get_args(self.kind) if is_union else (self.kind,)) if one is not type(None)
        )

    @cached_property
    def flags(self) -> tuple[str, ...]:
        """Its flags, the long one last; empty without a flag."""
        if self.option.flag is None:
            return ()
        return tuple((self.option.flag or f"--{self.field.replace('_', '-')}").split())

    @property
    def name(self) -> str:
        """Its name in messages."""
        return self.flags[-1].lstrip("-") if self.flags else self.field

    @property
    def choices(self) -> tuple[str, ...] | None:
        """Allowed texts; None if others are allowed."""
        if self.option.choices is not None or self.option.read is not None:
            return self.option.choices
        return get_args(self.kinds[0]) if all(get_origin(one) is Literal for one in self.kinds) else None

    @property
    def metavar(self) -> str | None:
        """Placeholder for the value in help; None if the choices are shown."""
        if self.option.metavar or self.choices is not None:
            return self.option.metavar or None
        if self.kinds[0] is float:
            return "SHARE" if self.option.le == 1 else "DEG" if self.option.unit == "degrees" else "FACTOR"
        return {int: "N", bool: "on|off", Path: "FILE"}.get(self.kinds[0], self.name.upper())

    @property
    def names_files(self) -> bool:
        """Whether its values are paths."""
        return Path in self.kinds or any(Path in get_args(kind) for kind in self.kinds)

    @property
    def is_switch(self) -> bool:
        """Whether its flag takes no value."""
        return self.kind is bool and self.default is False and self.option.read is None

    @property
    def takes_on_off(self) -> bool:
        """Whether true and false are written "on" and "off"."""
        return "on|" in (self.metavar or "") and not self.is_switch

    def help(self, default: str | None = None, **named: str) -> str:
        """Help text; range and default are generated, so they cannot be wrong."""
        words = self.words
        for name, text in named.items():
            words = words.replace(f"{{{name}}}", text)
        default = self._default_words() if default is None else default
        parts = [words, self.option.span, f"default {default}" if default else ""]
        return "; ".join(part for part in parts if part).replace("%", "%%")

    def schema(self) -> dict[str, Any]:
        """JSON schema of a value, with the words of the help as its description."""
        kinds = {float: "number", int: "integer", bool: "boolean"}
        limits = {"ge": "minimum", "gt": "exclusiveMinimum", "le": "maximum", "lt": "exclusiveMaximum"}
        one: dict[str, Any] = {"type": kinds.get(self._item, "string")}
        one |= {word: found for of, word in limits.items() if (found := getattr(self.option, of)) is not None}
        if self.choices is not None:
            one["enum"] = list(self.choices)
        is_list = get_origin(self.kinds[0]) is tuple
        made = {"type": "array", "items": one} if is_list else one
        return made | {"description": self.words}

    @property
    def _item(self) -> Any:
        """The type of a value, or of an item of one that is a tuple."""
        kind = self.kinds[0]
        return get_args(kind)[0] if get_origin(kind) is tuple else kind

    def _default_words(self) -> str:
        if self.option.default is not None or self.is_switch:
            return self.option.default or ""
        if self.of.IN_LOOKS:
            return "that of the look"
        return "none" if self.default is None else self.text_of(self.default)

    def text_of(self, value: Any) -> str:
        """A value as text of its flag."""
        if isinstance(value, bool):
            return "on" if value else "off"
        if isinstance(value, tuple):
            return self.option.written[0].join(map(self.text_of, value))
        if isinstance(value, int | float):
            return number_text(degrees(value) if self.option.unit == "degrees" else value)
        return str(value)

    def check(self, value: Any) -> None:
        """Raise ValueError for a value of another type or out of range."""
        if value is None:
            return
        self._check_type(value)
        if self.option.span:
            for number in value if isinstance(value, tuple | list) else (value,):
                if _is_number(number):
                    self._check_number(degrees(number) if self.option.unit == "degrees" else number)

    def _check_type(self, value: Any) -> None:
        if choices := self.choices:
            is_fit, wanted = isinstance(value, str) and value in choices, listed(choices)
        else:
            kind, is_fit, wanted = self.kinds[0], True, in_words(self.kind)
            if all(one in (int, float) for one in self.kinds):
                is_fit = _is_number(value)
            elif kind is bool:
                is_fit = isinstance(value, bool)
            elif get_origin(kind) is tuple and len(self.kinds) == 1:
                is_fit = isinstance(value, tuple | list)
        if not is_fit:
            raise ValueError(f"{self.name} must be {wanted}, got {shown(value)}")

    def _check_number(self, number: float) -> None:
        if self.option.holds(number):
            return
        cure = ""
        if self.option.takes_percent and 1 < number <= 100 and self.option.le == 1:
            cure = f"; for {number:g} % write {number / 100:g} or {number:g}%"
        found = f"{number:g}" if isinstance(number, float) else str(number)
        raise ValueError(f"{self.name} must be {self.option.span}, got {found}{cure}")

    def read(self, text: str) -> Any:
        """Parse text.

        Raises:
            ValueError: if it is invalid; the message lacks the name of the option.
        """
        if self.option.read is not None:
            return _named_elsewhere(self.option.read, text)
        if self.choices is not None:
            text = current(text)
            if text not in self.choices:
                known = ", ".join(self.choices)
                raise ValueError(f"must be one of {known}, got {shown(text)}{hint_for(text, self.choices)}")
            return text
        kind = self.kinds[0]
        if get_origin(kind) is tuple:
            return self._read_items(text, get_args(kind))
        if kind is float:
            return self._held(parse_share(text) if self.option.takes_percent else number(text))
        if kind is int:
            return count(text, int(self.option.ge or 0))
        return on_off(text) if kind is bool else Path(text) if kind is Path else text

    def _read_items(self, text: str, kinds: tuple[Any, ...]) -> tuple[Any, ...]:
        if kinds[0] is float and kinds[1:] != (...,):
            return tuple(self._held(numbers(text, len(kinds))))
        words = tuple(word.strip() for word in text.split(","))
        return tuple(count(word, 1) for word in words) if kinds[0] is int else words

    def _held(self, value: Any) -> Any:
        """Numbers as stored: angles in radians."""
        if self.option.unit != "degrees":
            return value
        return tuple(map(radians, value)) if isinstance(value, tuple) else radians(value)

    def value(self, given: Any, *, is_strict: bool = False) -> Any:
        """Convert a Python or TOML value.

        Args:
            given: text as for the flag, or a value of its type.
            is_strict: accept text only if the type is text or the option has `read`.

        Raises:
            ValueError: if it is invalid; the message lacks the name of the option.
        """
        given = given.tolist() if hasattr(given, "tolist") else given  # from NumPy
        if self.option.make is not None and not isinstance(given, str):
            return _named_elsewhere(self.option.make, given)
        if isinstance(given, str) and (self.option.read is not None or not is_strict):
            return self.read(given)
        if not is_strict and self.kinds[0] is str:
            given = _as_text(given)
        if is_strict and self._is_text_form():
            raise ValueError(f"must be text in quotes, got {shown(given)}")
        try:
            return self._held(fitted(given, self.kind))
        except ValueError:
            if is_strict or self.option.read is None or isinstance(given, bool | Mapping):
                raise
        return self.read(self.text_of(tuple(given) if isinstance(given, list) else given))

    def _is_text_form(self) -> bool:
        """Whether values are an object that text describes, rather than a number, a word or a list."""
        kind = self.kinds[0]
        is_plain = get_origin(kind) is tuple or kind in (int, float, bool, str)
        return self.option.read is not None and not is_plain


def _as_text(given: Any) -> Any:
    """Items as text with commas, a path as text; anything else as it is."""
    if isinstance(given, list | tuple) and given:
        return ",".join(map(str, given))
    return str(given) if isinstance(given, list | tuple | Path) else given


class _Table(dict[type, tuple[Row, ...]]):
    """Rows by class."""

    def __missing__(self, kind: type[Options]) -> tuple[Row, ...]:
        notes: dict[str, Any] = {}
        for one in reversed(kind.__mro__):
            notes |= vars(one).get("__annotations__", {})
        names, defaults = kind.__struct_fields__, kind.__struct_defaults__
        without = len(names) - len(defaults)
        self[kind] = tuple(
            Row(name, notes[name], None if i < without else defaults[i - without], kind)
            for i, name in enumerate(names)
        )
        return self[kind]


_TABLE = _Table()


def rows_of(kind: type[Options]) -> tuple[Row, ...]:
    """The rows of a class."""
    return _TABLE[kind]


@cache
def row_of(kind: type[Options], field: str) -> Row:
    """The row of a field."""
    return next(row for row in rows_of(kind) if row.field == field)


def values_of(options: Struct) -> dict[str, Any]:
    """The fields of options by name."""
    return msgspec.structs.asdict(options)


def changed(options: Options) -> dict[str, Any]:
    """The fields that differ from the defaults of their class."""
    return {
        row.field: value
        for row in rows_of(type(options))
        if (value := getattr(options, row.field)) != row.default
    }


def read_table(table: Mapping[str, Any], rows: Mapping[str, Row], place: str = "") -> dict[str, Any]:
    """Convert a table of TOML or JSON.

    Args:
        table: name -> value.
        rows: allowed rows by name.
        place: prefix of messages.

    Raises:
        ValueError: if a name is unknown (the message suggests the nearest), or a value is invalid.
    """
    values: dict[str, Any] = {}
    for name, given in table.items():
        if name not in rows:
            cure = hint_for(name, rows) or f"; it has {', '.join(rows)}"
            raise ValueError(f"{place}has no {name!r}{cure}")
        try:
            values[name] = rows[name].value(given, is_strict=True)
        except ValueError as error:
            raise ValueError(f"{place}{name} {error}") from None
    return values


class NestedError(ValueError):
    """An error in one of several values of an option; the message names the value."""


def unnamed(error: ValueError) -> ValueError:
    """The error without the value's name before "must"."""
    if isinstance(error, NestedError):
        return error
    name, must, rule = str(error).partition(" must ")
    return ValueError(f"must {rule}") if must and " " not in name else error


def _named_elsewhere(make: Callable[[Any], Any], given: Any) -> Any:
    """Call `make`; errors lose the name that it gives the value."""
    try:
        return make(given)
    except ValueError as error:
        raise unnamed(error) from None


def shown(value: Any) -> str:
    """A foreign value for a message, shortened."""
    import reprlib

    short = reprlib.Repr()
    short.maxstring = short.maxother = 80
    return short.repr(value)


def fitted(given: Any, kind: Any) -> Any:
    """Convert a Python or TOML value to a type.

    Raises:
        ValueError: if it is of another type, or not finite.
    """
    try:
        made = _fitted(given, kind)
    except (msgspec.ValidationError, OverflowError, TypeError):
        raise ValueError(f"must be {in_words(kind)}, got {shown(given)}") from None
    return made


def _fitted(given: Any, kind: Any) -> Any:
    if get_origin(kind) in (UnionType, Union):
        tried = [one for one in get_args(kind) if one is not type(None)]
        for one in tried[:-1]:
            try:
                return _fitted(given, one)
            except (msgspec.ValidationError, TypeError):
                continue
        return _fitted(given, tried[-1])
    if kind is Path:
        return Path(given)
    if kind is str and not isinstance(given, str):
        given = str(given) if isinstance(given, Path) else given
    if get_origin(kind) is tuple and isinstance(given, list | tuple):
        return _fitted_items(given, get_args(kind))
    if kind in (int, float):
        return _fitted_number(given, kind)
    return msgspec.convert(given, kind)


def _fitted_items(given: Any, items: tuple[Any, ...]) -> tuple[Any, ...]:
    items = (items[0],) * len(given) if items[1:] == (...,) else items
    if len(items) != len(given):
        raise TypeError
    return tuple(_fitted(one, of) for one, of in zip(given, items, strict=True))


def _fitted_number(given: Any, kind: type) -> int | float:
    if not _is_number(given) or not isfinite(given) or abs(given) >= LARGEST:
        raise TypeError
    if kind is float:
        return float(given)
    if isinstance(given, float) or int(given) != given or abs(given) >= 2**63:
        raise TypeError
    return int(given)


def _is_number(value: Any) -> bool:
    return not isinstance(value, bool | str | bytes) and hasattr(type(value), "__float__")


def in_words(kind: Any) -> str:
    """A type in words, for messages."""
    kinds = get_args(kind)
    if get_origin(kind) in (UnionType, Union):
        return " or ".join(in_words(one) for one in kinds if one is not type(None))
    if get_origin(kind) is Literal:
        return listed([repr(one) for one in kinds])
    if get_origin(kind) is tuple:
        if kinds[1:] == (...,):
            return "a list of numbers" if kinds[0] is int else 'a list of texts such as ["flat", "dab"]'
        return f"a list of {len(kinds)} numbers"
    words = {bool: "true or false", int: "a whole number", float: "a number"}
    return words.get(kind, "text in quotes")


def listed(words: Iterable[str], last: str = "or") -> str:
    """Words as a list in a sentence: "PNG, TIFF or OpenEXR"."""
    *first, end = words
    return f"{', '.join(first)} {last} {end}" if first else end


def hint_for(word: str, known: Any) -> str:
    """A hint at the nearest known word, as a question; "" if none is close."""
    from difflib import get_close_matches

    closest = get_close_matches(word[:100], list(known), n=1, cutoff=0.6)
    return f"; did you mean {closest[0]!r}?" if closest else ""


def number_text(value: float) -> str:
    """A number as the shortest exact text."""
    if float(value).is_integer() and abs(value) < 1e15:
        return str(int(value))
    text = f"{value:g}"
    return text if float(text) == value else repr(float(value))


def number(text: str) -> float:
    """Parse a finite number."""
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not isfinite(value):
        raise ValueError(f"must be a number, got {text!r}")
    return value


def parse_share(text: str) -> float:
    """Parse "0.7" or "70%"; percentages must be at most 100 %, no other range is checked."""
    try:
        value = number(text.removesuffix("%"))
    except ValueError:
        raise ValueError(f"must be a number, got {text!r}") from None
    if not text.endswith("%"):
        return value
    if value > 100:
        raise ValueError(f"must be at most 100 %, got {text!r}")
    return value / 100


def numbers(text: str, count: int) -> tuple[float, ...]:
    """Parse `count` finite numbers, separated by commas."""
    words = text.split(",")
    if len(words) != count:
        raise ValueError(f"must be {count} numbers separated by commas, got {text!r}")
    return tuple(map(number, words))


def count(text: str, least: int) -> int:
    """Parse a whole number of `least` or more."""
    digits = text.removeprefix("+")
    if not (digits.isascii() and digits.isdecimal() and len(digits) <= 18) or int(digits) < least:
        raise ValueError(f"must be a whole number of {least} or more, got {text!r}")
    return int(digits)


def on_off(text: str) -> bool:
    """Parse "on" or "off"."""
    if text not in ("on", "off"):
        raise ValueError(f"must be on or off, got {text!r}")
    return text == "on"
