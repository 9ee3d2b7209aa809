"""Read hand-written TOML files (looks and rules), with limits on size and depth."""

import re
from pathlib import Path
from typing import Any

from brushgs.errors import SceneError


def read_text(path: Path, what: str, max_bytes: int) -> str:
    """Read a text file.

    Args:
        path: the file.
        what: its kind, for messages, such as "a look".
        max_bytes: size limit.

    Raises:
        SceneError: if it cannot be read, is too large, or is not UTF-8.
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
    """Parse TOML text; `path` and `advice` are for messages.

    Raises:
        SceneError: if it is not TOML, or nested too deeply.
    """
    import tomllib

    try:
        return tomllib.loads(text)
    except RecursionError:
        raise SceneError(path, f"is nested too deeply; {advice}") from None
    except ValueError as error:  # syntax errors, and numbers with too many digits
        raise SceneError(path, f"is not TOML: {str(error)[:200]}; {advice}") from None


def line_of(text: str, key: str, table: str = "", index: int = 0) -> int | None:
    """Line number, from 1, of a key, for messages; None if it is not found.

    Args:
        text: the file's text.
        key: as written in the file, or with "_" for "-"; may be the name of a table.
        table: table of the key, "" for the top level.
        index: of the table among several [[table]].
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
    """The value, with file names resolved to `folder` if they exist there."""
    if isinstance(value, tuple):
        return tuple(located(item, folder) for item in value)
    if isinstance(value, str) and ("." in value or "/" in value) and "\0" not in value:
        path = folder / value
        return str(path) if len(value) < 1000 and path.exists() else value
    return value
