"""Values of TOML files that one writes by hand, looks and rules: read, typed, and refused in words."""

import re
import reprlib
import tomllib
from collections.abc import Callable
from difflib import get_close_matches
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from brushgs.errors import SceneError

_BELOW = {int: 2**63, float: 1e300}  # magnitudes of numbers


def read_text(path: Path, what: str, max_bytes: int) -> str:
    """The text of a file.

    Args:
        path: of the file.
        what: it is, in words, such as "a look".
        max_bytes: that it may have.

    Raises:
        SceneError: if it cannot be read, is larger, or no text in UTF-8.
    """
    try:
        with path.open("rb") as file:
            content = file.read(max_bytes + 1)
    except OSError as error:
        raise SceneError(path, f"cannot be read: {(error.strerror or str(error)).lower()}") from None
    if len(content) > max_bytes:
        raise SceneError(path, f"must have at most {max_bytes} bytes; {what} is a small TOML file")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise SceneError(path, f"must be text in UTF-8, byte {error.start} is not; {what} is TOML") from None


def read_toml(text: str, path: Path, advice: str) -> dict[str, Any]:
    """The tables of a text; `path` and `advice` are for the message.

    Raises:
        SceneError: if it is not TOML, or nested too deeply.
    """
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise SceneError(path, f"is nested too deeply; {advice}") from None
    except ValueError as error:  # of the syntax, and numbers of too many digits
        raise SceneError(path, f"is not TOML: {str(error)[:200]}; {advice}") from None


def line_of(text: str, key: str, table: str = "", index: int = 0) -> int | None:
    """The line, from 1, where a key stands in a file, for a message; None if it is not found.

    Args:
        text: of the file.
        key: as it is written there, or with "_" for "-".
        table: that it stands in, "" for above all; or the key is itself that of a table.
        index: of the table, where it is one of several [[table]].
    """
    name = re.escape(key).replace("_", "[-_]").replace(r"\-", "[-_]")
    assigned = re.compile(rf"""\s*["']?{name}["']?\s*[=.]""")
    header = re.compile(r"\s*\[{1,2}\s*([^\]]+?)\s*\]")
    current, seen = "", -1
    for number, line in enumerate(text.splitlines(), start=1):
        if match := header.match(line):
            current = match[1]
            seen += bool(re.fullmatch(name, current)) if not table else current == table
            if not table and seen == index:
                return number
        elif current == table and (not table or seen == index) and assigned.match(line):
            return number
    return None


def typed_value(value: Any, kind: Any, special: Callable[[Any], Any] | None) -> Any:
    """A value of TOML as one of a field.

    Raises:
        ValueError: if the field takes no such value; without the name of the field.
    """
    if special is not None:
        return special(value)
    fits, made = _fitted(value, kind)
    if not fits:
        raise ValueError(f"must be {_in_words(kind)}, got {reprlib.repr(value)}")
    return made


def _fitted(value: Any, kind: Any) -> tuple[bool, Any]:
    """Whether a value of TOML is of a type, and the value."""
    kinds = get_args(kind)
    if get_origin(kind) is Annotated:
        return _fitted(value, kinds[0])
    if get_origin(kind) in (UnionType, Union):
        tried = (_fitted(value, one) for one in kinds)
        return next((found for found in tried if found[0]), (False, None))
    if get_origin(kind) is Literal:
        return isinstance(value, str) and value in kinds, value
    if get_origin(kind) is tuple:
        return _fitted_items(value, kinds)
    if kind in _BELOW:
        is_number = isinstance(value, kind | int) and not isinstance(value, bool)
        is_fit = is_number and abs(value) < _BELOW[kind]
        return is_fit, kind(value) if is_fit else None
    return isinstance(value, kind), value


def _fitted_items(value: Any, kinds: tuple[Any, ...]) -> tuple[bool, Any]:
    """The same of a list that becomes a tuple of these types, or of any length where the second is `...`."""
    if not isinstance(value, list):
        return False, None
    kinds = (kinds[0],) * len(value) if kinds[1:] == (...,) else kinds
    items = [_fitted(item, one) for item, one in zip(value, kinds, strict=False)]
    is_fit = len(value) == len(kinds) and all(fits for fits, _ in items)
    return is_fit, tuple(item for _, item in items)


def _in_words(kind: Any) -> str:
    """What a field takes."""
    kinds = get_args(kind)
    if get_origin(kind) is Annotated:
        return _in_words(kinds[0])
    if get_origin(kind) in (UnionType, Union):
        return " or ".join(_in_words(one) for one in kinds if one is not type(None))
    if get_origin(kind) is Literal:
        return _listed([repr(one) for one in kinds])
    if get_origin(kind) is tuple:
        if kinds[1:] == (...,):
            return 'a list of texts such as ["flat", "dab"]'
        return f"a list of {len(kinds)} numbers"
    words = {bool: "true or false", int: "a whole number", float: "a number", str: "text in quotes"}
    return words.get(kind, "text in quotes")


def _listed(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"


def parsed_text(parse: Callable[[str], Any], value: Any) -> Any:
    """A value that is text with a form of its own, made by `parse`.

    Raises:
        ValueError: if it is none; without the name of the field.
    """
    if not isinstance(value, str):
        raise ValueError(f"must be text in quotes, got {reprlib.repr(value)}")
    try:
        return parse(value)
    except ValueError as error:
        _, _, rule = str(error).partition(" ")  # without the name of the field, which is said already
        raise ValueError(rule) from None


def located(value: Any, folder: Path) -> Any:
    """The same with files that lie in a folder; other names stay."""
    if isinstance(value, tuple):
        return tuple(located(item, folder) for item in value)
    if isinstance(value, str) and ("." in value or "/" in value) and "\0" not in value:
        path = folder / value
        return str(path) if len(value) < 1000 and path.exists() else value
    return value


def hint_for(word: str, known: Any) -> str:
    """A question for the nearest of the known words; "" if none is near."""
    closest = get_close_matches(word[:100], list(known), n=1, cutoff=0.6)
    return f"; did you mean {closest[0]!r}?" if closest else ""
