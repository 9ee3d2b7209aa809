"""What the tables of file formats share: how a file is recognised, and how formats are listed in a sentence.

The tables are `scenes/formats.py`, `cameras/formats.py` and `pictures/formats.py`. Help texts read them, so
they import nothing heavy; the module that reads or writes a format is imported when it is used.
"""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Protocol, TypeVar

NUM_FIRST_BYTES = 64  # enough to recognise a file by
Matcher = Callable[[Path, bytes], bool]  # (path, first bytes; none of a folder) -> whether it is of a format


class Suffixed(Protocol):
    """A row of a table."""

    @property
    def suffixes(self) -> tuple[str, ...]:
        """Of its files, in lower case, the usual one first."""


Row = TypeVar("Row", bound=Suffixed)


def begins_with(*beginnings: bytes) -> Matcher:
    """Recognises files by their first bytes, whatever they are called."""
    return lambda path, begin: begin.startswith(beginnings)


def has_suffix(*suffixes: str) -> Matcher:
    """Recognises files by their name: for formats that have no unmistakable beginning."""
    return lambda path, begin: path.suffix.lower() in suffixes


def find_by_suffix(formats: Iterable[Row], path: str | Path) -> Row | None:
    """The format that a file is to be written in; None if no format has its suffix."""
    suffix = Path(path).suffix.lower()
    return next((row for row in formats if suffix in row.suffixes), None)


def suffixes_of(formats: Iterable[Suffixed]) -> tuple[str, ...]:
    """All suffixes, in the order of the table."""
    return tuple(suffix for row in formats for suffix in row.suffixes)


def in_words(items: Sequence[str], conjunction: str = "or") -> str:
    """A list in a sentence: "PNG, TIFF or OpenEXR"."""
    *first, last = items
    return f"{', '.join(first)} {conjunction} {last}" if first else last
