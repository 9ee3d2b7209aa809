"""Parse untrusted JSON into msgspec structs, if the result fits in memory.

Text grows when it is parsed: "[]," is three bytes and takes 72 bytes as a list in a list. So the memory is
estimated from the punctuation before a file is parsed. A value that does not fit its struct gives an error of
one sentence: file, place, rule, value.

msgspec decodes valid files directly. Any other file is parsed again by the standard library, to find the
wrong value, or to accept what msgspec refuses: NaN in a field that is not read, 3.0 for an integer, a byte
order mark.
"""

import codecs
import json
import re
from difflib import get_close_matches
from math import isfinite, prod
from pathlib import Path
from typing import Annotated, Any, TypeVar, cast

import msgspec
import numpy as np
from msgspec import Meta, inspect

from brushgs.errors import SceneError
from brushgs.options.table import listed
from brushgs.values.arrays import F64

MAX_BYTES = 1 << 25  # of a file; 40,000 views as nerfstudio writes them take some 20 MB
# Bytes of memory allowed beyond twice the file size, not counting temporary memory of parser and interpreter.
_ALLOWED = 80 << 20
# Most bytes of memory for each punctuation mark: "," a number and its place in a list, "[" a list, ":" an
# entry of an object, '"' half of a string. Measured with CPython 3.11, rounded up.
_COST = {b",": 34, b"[": 96, b":": 30, b'"': 27}
OBJECT = 900  # bytes for "{": an object with the camera made of it
SMALL_OBJECT = 280  # bytes for an object of up to five entries from which nothing larger is made
_WHOLE = 1 << 53  # integers of smaller magnitude are exact as floats
_SHOWN, _FEW = 60, 16  # characters of a value in a message, and entries of a list that are shown


def check_memory(path: Path, content: bytes, object_bytes: int = OBJECT, *, has_names: bool = False) -> None:
    """Raise SceneError if the values of JSON text would take too much memory.

    `object_bytes` is the memory for an object and what is made of it; `has_names` is whether strings are
    used, for example as file names, so that characters beyond ASCII matter.
    """
    needed = sum(content.count(mark) * cost for mark, cost in (_COST | {b"{": object_bytes}).items())
    if b"\\u" in content or (has_names and not content.isascii()):
        needed += 4 * len(content)  # one character beyond ASCII: its string takes up to 4 bytes a character
    if needed > _ALLOWED + len(content):
        rule = f"would take {needed >> 20} MiB of memory for {len(content) / 2**20:.1f} MiB of text"
        raise SceneError(path, f"{rule}; split it, or remove what is not needed")


def parse_checked(path: Path, content: bytes, cure: str, *, has_names: bool = False) -> Any:
    """Parse JSON text that passed `check_memory`. Numbers that are not finite become `NotFinite`."""
    try:
        return parse_json(content.decode("utf-8-sig") if has_names else _text(content))
    except RecursionError:
        raise SceneError(path, f"is not JSON for this use (it is nested too deeply); {cure}") from None
    except ValueError as error:
        raise SceneError(path, f"is not JSON ({error}); {cure}") from None


def parse_json(text: str) -> Any:
    """Parse JSON. Raises ValueError, or RecursionError if it is nested too deeply.

    Integral numbers become int, even 3.0; numbers that are not finite become `NotFinite`.
    """
    return json.loads(text, parse_int=_number, parse_float=_number, parse_constant=NotFinite)


class NotFinite(str):
    """The text of a number that is not finite, such as 1e999 and NaN."""


def _number(text: str) -> float | str:
    value = float(text)
    if value.is_integer() and abs(value) < _WHOLE and not text.startswith("-0"):
        return int(value)
    return value if isfinite(value) else NotFinite(text)


def as_count(value: object, most: int) -> int | None:
    """A parsed number as an int if it is integral and in 0 to `most`; else None."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= most or value % 1:
        return None
    return int(value)


def shown(value: object, length: int = _SHOWN, depth: int = 3) -> str:
    """The first `length` characters of a value as JSON, for messages; long values are converted in part."""
    if isinstance(value, list):
        parts = [shown(part, length, depth - 1) for part in value[:_FEW]] if depth else ["..."]
        text = f"[{', '.join(parts)}{', ...' if len(value) > _FEW else ''}]"
    elif isinstance(value, dict):
        text = "{" + ", ".join(json.dumps(name[:length]) + ": ..." for name in list(value)[:_FEW]) + "}"
    elif isinstance(value, NotFinite):
        text = value
    elif isinstance(value, str):
        text = json.dumps(value[:length])
    else:  # show 3.0 as 3, as it was probably written
        is_whole = isinstance(value, float) and value.is_integer() and abs(value) < _WHOLE
        text = json.dumps(int(value) if is_whole else value)  # type: ignore[call-overload]
    return text[:length]


def _text(content: bytes) -> str:
    """UTF-8 text with each byte beyond ASCII replaced by "?", for callers that use no strings.

    Raises UnicodeDecodeError if it is not UTF-8.
    """
    if not content.isascii():
        decoder = codecs.getincrementaldecoder("utf-8")()
        for start in range(0, len(content), 1 << 16):
            decoder.decode(content[start : start + (1 << 16)])
        decoder.decode(b"", final=True)
        content = content.translate(_ASCII)
    return content.decode("ascii")


_ASCII = bytes(byte if byte < 128 else ord("?") for byte in range(256))


T = TypeVar("T")
_FINITE = Meta(description="a finite number")
# Numbers in up to three levels of lists; `shaped` checks their shape.
Numbers = list[Annotated[float | list[Annotated[float | list[float], _FINITE]], _FINITE]]

_FAULT = re.compile(r"(.*?)(?: - at `(?:key in )?\$(.*)`)?", re.DOTALL)


def decode(
    path: Path,
    content: bytes,
    kind: type[T],
    cure: str,
    *,
    root: str = "",
    object_bytes: int = OBJECT,
    has_names: bool = False,
) -> T:
    """Decode JSON text to a struct or a list of structs; all numbers are finite.

    `cure` says in messages what to do about a file that does not fit, and `root` names the list if the
    top-level value is one, such as "cameras"; for the others see `check_memory`.

    Raises:
        SceneError: if the value would take too much memory, the text is no JSON, or a value does not fit.
    """
    check_memory(path, content, object_bytes, has_names=has_names)
    try:
        return msgspec.json.decode(content, type=kind)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        value = parse_checked(path, content, cure, has_names=has_names)
    return convert(path, value, kind, cure, root)


def convert(path: Path, value: object, kind: type[T], cure: str, root: str = "") -> T:
    """Convert a parsed value to a struct as `decode` does. `root` is the place of the value for messages."""
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        raise SceneError(path, _sentence(str(error), value, kind, cure, root)) from None
    except UnicodeEncodeError as error:  # half of a surrogate pair
        raise SceneError(path, f"is not JSON ({error}); {cure}") from None
    except RecursionError:
        raise SceneError(path, f"is not JSON for this use (it is nested too deeply); {cure}") from None


def fault(error: msgspec.ValidationError, value: object, kind: type) -> str:
    """The message about a wrong value, without file and cure: "brush_counts[0] must be ..."."""
    return _sentence(str(error), value, kind, "", "").removesuffix("; ")


def refused(path: Path, place: str, rule: str, value: object, cure: str) -> SceneError:
    """The error for a value that breaks a rule beyond its type, worded as by `decode`."""
    return SceneError(path, f"{place} must be {rule}, got {shown(value)}; {cure}".lstrip())


def missing(path: Path, place: str, rule: str, cure: str) -> SceneError:
    """The error for a missing field that other fields require."""
    return SceneError(path, f"{place} is missing, it must be {rule}; {cure}")


def shaped(values: object, *shapes: tuple[int, ...]) -> F64 | None:
    """Numbers, nested or not, reshaped to the first shape of their size; None if there is none."""
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):  # a ragged list
        return None
    shape = next((shape for shape in shapes if prod(shape) == array.size), None)
    return None if shape is None else array.reshape(shape)


def _sentence(fault: str, value: Any, kind: Any, cure: str, root: str) -> str:
    """A message of msgspec, reworded."""
    message, steps = cast(re.Match[str], _FAULT.fullmatch(fault)).groups(default="")
    info, place = inspect.type_info(kind), root + steps if root else steps.removeprefix(".")
    for step in re.findall(r"[^.\[\]]+|\.\.\.", steps):
        info = _inside(info, step)
        if step == "...":  # msgspec does not tell the key
            value = None
        elif value is not None:
            value = value[int(step) if isinstance(value, list) else step]
    field = message.partition("`")[2].partition("`")[0]
    within = f"{place}.{field}".removeprefix(".")
    if message.startswith("Object missing"):
        return f"{within} is missing, it must be {_rule(_inside(info, field))}; {cure}"
    if message.startswith("Object contains"):
        names = [one.encode_name for some in _members(info) for one in getattr(some, "fields", ())]
        near = get_close_matches(field, names, 1)
        known = f", the nearest is {near[0]!r}" if near else f" among {', '.join(names)}"
        return f"{within[:200]} is no known field{known}; remove or correct it"
    if message.startswith("."):  # from a `__post_init__`: ".field must be ..."
        return f"{place}{message}; {cure}".removeprefix(".")
    is_long = "length" in message and isinstance(value, list) and len(value) > _FEW
    got = f"{len(value)} entries" if is_long else shown(value)
    rule = _rule(info) if place else _rule(info).replace("an object", "a JSON object")
    return f"{place} must be {rule}, got {got}; {cure}".lstrip()


def _members(info: Any) -> list[Any]:
    """The members of a union type, without null; a list of one for any other type."""
    if isinstance(info, inspect.Metadata):
        return _members(info.type)
    if isinstance(info, inspect.UnionType):
        return [one for member in info.types for one in _members(member)]
    return [] if isinstance(info, inspect.NoneType) else [info]


def _inside(info: Any, step: str) -> Any:
    """The type of a field or an entry."""
    for one in _members(info):
        for field in getattr(one, "fields", ()):
            if field.encode_name == step:
                return field.type
        if isinstance(one, inspect.TupleType):
            return one.item_types[int(step)]
        for inner in ("item_type", "value_type"):
            if hasattr(one, inner):
                return getattr(one, inner)
    return info


def _rule(info: Any) -> str:
    """What a value must be, in words: its description, else its type and range."""
    if isinstance(info, inspect.Metadata):
        described = (info.extra_json_schema or {}).get("description")
        return str(described) if described else _rule(info.type)
    if isinstance(info, inspect.UnionType):
        found = [_rule(one) for one in info.types if not isinstance(one, inspect.NoneType)]
        return listed(list(dict.fromkeys(found)))
    if isinstance(info, inspect.FloatType | inspect.IntType):
        return _number_rule(info)
    if isinstance(info, inspect.LiteralType):
        return listed([shown(one) for one in info.values])
    if isinstance(info, inspect.TupleType):
        are_numbers = all(isinstance(one, inspect.FloatType) for one in _members(info.item_types[0]))
        return f"{len(info.item_types)} numbers" if are_numbers else f"a list of {len(info.item_types)}"
    if isinstance(info, inspect.ListType | inspect.VarTupleType):
        span = _span(info.min_length, info.max_length)
        return f"a list of{span.removeprefix(' of')}" if span else "a list"
    return _NOUNS.get(type(info), "another value")


def _number_rule(info: Any) -> str:
    high = info.lt if info.le is None else info.le
    span = _span(info.gt, high, " above ") if info.ge is None else _span(info.ge, high)
    kind = "whole " if isinstance(info, inspect.IntType) else "" if span else "finite "
    return f"a {kind}number{span}"


def _span(low: float | None, high: float | None, above: str = " ") -> str:
    """A range in words with a blank before it; "" if there are no limits."""
    ends = [str(end) if isinstance(end, int) else f"{end:g}" for end in (low, high) if end is not None]
    if len(ends) == 2:
        return f"{above}{ends[0]} to {ends[1]}"
    if low is not None:
        return f" of {ends[0]} or more" if above == " " else f"{above}{ends[0]}"
    return f" of at most {ends[0]}" if ends else ""


_NOUNS: dict[type, str] = {
    inspect.BoolType: "true or false",
    inspect.BytesType: "base64",
    inspect.DictType: "an object",
    inspect.StrType: "text",
    inspect.StructType: "an object",
}
