"""JSON from outside: read whole, but never more of it than the memory holds, and quoted only in part.

Text grows when it becomes objects: "[]," is three bytes and 72 bytes as a list in a list. So what a file
will take is estimated from its punctuation before it is parsed.
"""

import codecs
import json
from pathlib import Path
from typing import Any

from brushgs.errors import SceneError
from brushgs.io.files import read_whole

MAX_BYTES = 1 << 25  # of a file; 40,000 views as nerfstudio writes them have some 20 MB
# Bytes of memory beside twice the file, less what the parser and the interpreter need on the way.
_ALLOWED = 80 << 20
# Most that one of these stands for, in bytes: a number and its place in a list; a list; an object, with the
# camera that will be made of it; an entry; half of a string. Measured with CPython 3.11, rounded up.
_COST = {b",": 34, b"[": 96, b"{": 900, b":": 30, b'"': 27}
_SHOWN, _FEW = 60, 16  # characters of a value in a message, and entries of a list that are looked at


def read_json(path: Path, cure: str) -> object:
    """The content of a JSON file, all of its numbers as floats.

    Args:
        path: the file.
        cure: what to give in place of a file that is no JSON.

    Raises:
        SceneError: if there is no such plain file, it is larger than 32 MiB, would take more memory than
            twice its size and 100 MB, or is no JSON in UTF-8.
    """
    content = read_whole(path, MAX_BYTES)
    needed = sum(content.count(mark) * cost for mark, cost in _COST.items())
    if b"\\u" in content:
        needed += 4 * len(content)  # one such character, and a text takes four bytes for each of its own
    if needed > _ALLOWED + len(content):
        rule = f"would take {needed >> 20} MiB of memory for {len(content) / 2**20:.1f} MiB of text"
        raise SceneError(path, f"{rule}; split it, or leave out what is not needed")
    try:
        return parse_json(_text(content))
    except RecursionError:
        raise SceneError(path, f"is not JSON for this use (it is nested too deeply); {cure}") from None
    except ValueError as error:
        raise SceneError(path, f"is not JSON ({error}); {cure}") from None


def parse_json(text: str) -> Any:
    """The value that a text stands for. Raises ValueError, or RecursionError if it goes too deep.

    Every number becomes a float: one of a thousand digits is then infinite, and refused as such.
    """
    return json.loads(text, parse_int=float)


def shown(value: object, length: int = _SHOWN, depth: int = 3) -> str:
    """The beginning of a value as JSON, for a message; the rest of it is not even looked at."""
    if isinstance(value, list):
        parts = [shown(part, length, depth - 1) for part in value[:_FEW]] if depth else ["..."]
        text = f"[{', '.join(parts)}{', ...' if len(value) > _FEW else ''}]"
    elif isinstance(value, dict):
        text = "{" + ", ".join(json.dumps(name[:length]) + ": ..." for name in list(value)[:_FEW]) + "}"
    else:
        text = json.dumps(value[:length] if isinstance(value, str) else value)
    return text[:length]


def _text(content: bytes) -> str:
    """One byte a character, whatever the file holds: names of pictures are of no use here.

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
