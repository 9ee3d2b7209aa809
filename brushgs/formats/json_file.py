"""Untrusted JSON files: parsed only if the result fits in memory, and quoted in messages only in part.

Text grows when it is parsed: "[]," is three bytes and takes 72 bytes as a list in a list. So the memory is
estimated from the punctuation before a file is parsed.
"""

import codecs
import json
from math import isfinite
from pathlib import Path
from typing import Any

from brushgs.errors import SceneError
from brushgs.formats.files import read_whole

MAX_BYTES = 1 << 25  # of a file; 40,000 views as nerfstudio writes them take some 20 MB
# Bytes of memory beside twice the file, less what the parser and the interpreter need temporarily.
_ALLOWED = 80 << 20
# Most bytes of memory that each of these marks stands for: a number and its place in a list; a list; an
# object with its camera; an entry; half of a string. Measured with CPython 3.11, rounded up.
_COST = {b",": 34, b"[": 96, b":": 30, b'"': 27}
OBJECT = 900  # of the mark of an object
SMALL_OBJECT = 280  # of one with up to five entries, from which nothing larger is made
_WHOLE = 1 << 53  # below, floats are all whole numbers exactly
_SHOWN, _FEW = 60, 16  # characters of a value in a message, and entries of a list that are inspected


def read_json(path: Path, cure: str) -> object:
    """The content of a JSON file.

    Args:
        path: the file.
        cure: what to give in place of a file that is no JSON, for the message.

    Raises:
        SceneError: if there is no such regular file, it is larger than 32 MiB, would take more memory than
            twice its size and 100 MB, or is no JSON in UTF-8.
    """
    content = read_whole(path, MAX_BYTES)
    check_memory(path, content)
    return parse_checked(path, content, cure)


def check_memory(path: Path, content: bytes, object_bytes: int = OBJECT, *, has_names: bool = False) -> None:
    """Refuse JSON text whose values would not fit in memory.

    Args:
        path: the file, for messages.
        content: at most `MAX_BYTES` of it.
        object_bytes: memory that an object and what is made of it takes.
        has_names: whether strings are used, as names of files are, so that characters beyond ASCII matter.
    """
    needed = sum(content.count(mark) * cost for mark, cost in (_COST | {b"{": object_bytes}).items())
    if b"\\u" in content or (has_names and not content.isascii()):
        needed += 4 * len(content)  # one such character, and its string takes four bytes a character
    if needed > _ALLOWED + len(content):
        rule = f"would take {needed >> 20} MiB of memory for {len(content) / 2**20:.1f} MiB of text"
        raise SceneError(path, f"{rule}; split it, or remove what is not needed")


def parse_checked(path: Path, content: bytes, cure: str, *, has_names: bool = False) -> Any:
    """The value of JSON text that `check_memory` let pass. Numbers that are not finite become text."""
    try:
        return parse_json(content.decode("utf-8-sig") if has_names else _text(content))
    except RecursionError:
        raise SceneError(path, f"is not JSON for this use (it is nested too deeply); {cure}") from None
    except ValueError as error:
        raise SceneError(path, f"is not JSON ({error}); {cure}") from None


def parse_json(text: str) -> Any:
    """Parse JSON. Raises ValueError, or RecursionError if it is nested too deeply.

    Whole numbers are integers, also 3.0; what is not finite is `NotFinite`.
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
    """A parsed number as an integer, if it is one of 0 to `most`; else None."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= most or value % 1:
        return None
    return int(value)


def shown(value: object, length: int = _SHOWN, depth: int = 3) -> str:
    """The beginning of a value as JSON, for a message; the rest is not converted."""
    if isinstance(value, list):
        parts = [shown(part, length, depth - 1) for part in value[:_FEW]] if depth else ["..."]
        text = f"[{', '.join(parts)}{', ...' if len(value) > _FEW else ''}]"
    elif isinstance(value, dict):
        text = "{" + ", ".join(json.dumps(name[:length]) + ": ..." for name in list(value)[:_FEW]) + "}"
    elif isinstance(value, NotFinite):
        text = value
    elif isinstance(value, str):
        text = json.dumps(value[:length])
    else:  # 3.0 was written as 3, mostly
        is_whole = isinstance(value, float) and value.is_integer() and abs(value) < _WHOLE
        text = json.dumps(int(value) if is_whole else value)  # type: ignore[call-overload]
    return text[:length]


def _text(content: bytes) -> str:
    """One byte a character: other characters become "?", for names of pictures are not used here.

    Raises:
        UnicodeDecodeError: if it is not UTF-8.
    """
    if not content.isascii():
        decoder = codecs.getincrementaldecoder("utf-8")()
        for start in range(0, len(content), 1 << 16):
            decoder.decode(content[start : start + (1 << 16)])
        decoder.decode(b"", final=True)
        content = content.translate(_ASCII)
    return content.decode("ascii")


_ASCII = bytes(byte if byte < 128 else ord("?") for byte in range(256))
