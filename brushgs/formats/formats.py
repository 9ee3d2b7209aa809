"""What the tables of file formats share: how a file is recognised, and how formats are listed in a sentence.

The tables are `scenes/formats.py`, `cameras/formats.py` and `pictures/formats.py`. Help texts read them, so
they import nothing heavy; the module that reads or writes a format is imported when it is used.
"""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Protocol, TypeVar

from brushgs.formats.files import is_plain

NUM_FIRST_BYTES = 64  # enough to recognise a file by
BYTE_ORDER_MARK = b"\xef\xbb\xbf"
ZIP_BEGINNINGS = b"PK\x03\x04", b"PK\x05\x06"  # the latter of an empty archive
_MAX_JSON_BYTES = 1 << 25  # searched for keys
_MAX_DIRECTORY_BYTES = 1 << 20  # at the end of a zip archive
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


def is_json_with(*keys: str, file: str | None = None) -> Matcher:
    """Recognises JSON files by keys that occur in them at any place.

    Args:
        keys: all must occur.
        file: name of such a file; a folder that holds it is recognised too.
    """
    marks = [f'"{key}"'.encode() for key in keys]

    def matches(path: Path, begin: bytes) -> bool:
        if not begin:  # a folder
            if file is None or not is_plain(path / file):
                return False
            path = path / file
        elif not begin.removeprefix(BYTE_ORDER_MARK).lstrip().startswith(b"{"):
            return False
        try:
            with path.open("rb") as opened:
                content = opened.read(_MAX_JSON_BYTES)
        except OSError:
            return False
        return all(mark in content for mark in marks)

    return matches


def is_zip_with(name: str, *suffixes: str) -> Matcher:
    """Recognises zip archives by their suffix, or by the name of a member.

    Args:
        name: end of the name of a member, which stands in the directory at the end of an archive.
        suffixes: with which a damaged archive is recognised too.
    """

    def matches(path: Path, begin: bytes) -> bool:
        if not begin.startswith(ZIP_BEGINNINGS):
            return False
        if path.suffix.lower() in suffixes:
            return True
        try:
            with path.open("rb") as opened:
                opened.seek(max(0, opened.seek(0, 2) - _MAX_DIRECTORY_BYTES))
                return name.encode() in opened.read()
        except OSError:
            return False

    return matches


def any_of(*matchers: Matcher) -> Matcher:
    """Recognises what one of several recognises."""
    return lambda path, begin: any(matches(path, begin) for matches in matchers)


def find_by_suffix(formats: Iterable[Row], path: str | Path) -> Row | None:
    """The format that a file is to be written in; None if no format has its suffix.

    Of several suffixes that the name ends with, the longest decides: ".compressed.ply" before ".ply".
    """
    name = Path(path).name.lower()
    found = [(len(s), row) for row in formats for s in row.suffixes if name.endswith(s) and name != s]
    return max(found, key=lambda pair: pair[0])[1] if found else None


def suffixes_of(formats: Iterable[Suffixed]) -> tuple[str, ...]:
    """All suffixes, in the order of the table."""
    return tuple(suffix for row in formats for suffix in row.suffixes)
