"""Records of what is done, by which `--resume` knows what is left: JSON lines, a heading, then one a thing.

A line is added when a thing is done, so a run that is stopped loses nothing; the last line may be cut off.
"""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from brushgs.errors import SceneError
from brushgs.formats.files import read_whole, replacing

MAX_BYTES, MAX_LINES = 8 << 20, 200_000  # of a record; a path has at most 99,999 frames


def read_record(
    path: Path, key: str, fault: str, most: int = MAX_BYTES
) -> tuple[dict[str, Any], list[dict[str, Any]]] | None:
    """What the heading of a record of `most` bytes holds under `key`, and its entries; None without a file.

    Raises SceneError if it cannot be read, or with `fault` if it is something else.
    """
    try:
        path.stat()
    except FileNotFoundError:
        return None
    except OSError:
        pass  # reported when it is opened
    first, *lines = (_parsed(line) for line in read_whole(path, most).splitlines() or [b""])
    heading = first.get(key) if len(lines) <= MAX_LINES else None
    if not isinstance(heading, dict):
        raise SceneError(path, fault)
    return heading, [line for line in lines if line]


def begin_record(path: Path, heading: Mapping[str, Any], entries: Iterable[Mapping[str, Any]]) -> None:
    """Write a record anew. Raises SceneError if it cannot be written."""
    with replacing(path) as temporary:
        lines = [json.dumps(line) for line in (heading, *entries)]
        temporary.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")


def add_to_record(path: Path, entry: Mapping[str, Any]) -> None:
    """Add a thing that is done. Raises SceneError if it cannot be written."""
    try:
        with path.open("a", encoding="utf-8") as record:
            record.write(f"{json.dumps(entry)}\n")
    except OSError as error:
        raise SceneError(path, f"cannot be written ({error.strerror}); check the disk") from None


def _parsed(line: bytes) -> dict[str, Any]:
    """The object of a line; an empty one where it is cut off, or no object."""
    try:
        value = json.loads(line)
    except (ValueError, RecursionError):
        return {}
    return value if isinstance(value, dict) else {}
