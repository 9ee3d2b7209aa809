"""TOML files that one writes by hand, looks and rules: read with guards on size and depth in front."""

import re
from pathlib import Path
from typing import Any

from brushgs.errors import SceneError


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
    import tomllib

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


def located(value: Any, folder: Path) -> Any:
    """The same with files that lie in a folder; other names stay."""
    if isinstance(value, tuple):
        return tuple(located(item, folder) for item in value)
    if isinstance(value, str) and ("." in value or "/" in value) and "\0" not in value:
        path = folder / value
        return str(path) if len(value) < 1000 and path.exists() else value
    return value
