"""Read untrusted zip archives: the size of the directory is limited, and every fault is a SceneError."""

import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from brushgs.errors import SceneError
from brushgs.formats.files import open_plain

# Most bytes of a directory: 20,000 entries, which take 12 MB in memory. Scenes have about ten.
_MAX_DIRECTORY_BYTES = 1 << 20
_PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # others may ask for gigabytes of memory
ZIP_FAULTS = (
    zipfile.BadZipFile,
    zlib.error,
    EOFError,
    OSError,
    RuntimeError,
    NotImplementedError,
    ValueError,
)  # errors that reading an archive or a member may raise


@contextmanager
def open_zip(path: Path) -> Iterator[zipfile.ZipFile]:
    """Open the zip archive of a scene.

    Raises:
        SceneError: if it is damaged or its directory is too large.
    """
    with open_plain(path, "scene file") as file:
        bounded = _Bounded(file)
        try:
            archive = zipfile.ZipFile(bounded)
        except ZIP_FAULTS as error:
            fact = f"is a damaged zip archive ({str(error) or 'it is cut off'})"
            raise SceneError(path, f"{fact}; download or copy it again") from None
        bounded.most = None
        with archive:
            yield archive


def why_not_read(member: zipfile.ZipInfo) -> str | None:
    """Why a member cannot be read, as a clause; None if it can."""
    if member.flag_bits & 1:
        return "is encrypted"
    return None if member.compress_type in _PACKINGS else "is packed in a way that is not read"


def read_member(path: Path, archive: zipfile.ZipFile, name: str, most: int, cure: str) -> bytes:
    """The content of a member of an archive.

    Raises KeyError if there is no such member; SceneError if it is encrypted, in an unsupported compression,
    damaged, or larger than `most` bytes.
    """
    member = archive.getinfo(name)
    fault = why_not_read(member)
    if fault is None and member.file_size > most:
        fault = f"is larger than {most >> 20} MiB"
    try:
        if fault is None:
            with archive.open(member) as file:
                return file.read(most)
    except ZIP_FAULTS as error:
        fault = f"is damaged ({error})"
    raise SceneError(path, f"its {name[:80]} {fault}; {cure}")


class _Bounded:
    """A file that limits each read to `most` bytes, while the directory of an archive is read."""

    def __init__(self, file: BinaryIO) -> None:
        self.most: int | None = _MAX_DIRECTORY_BYTES
        self._file = file
        self.seek, self.tell, self.seekable, self.close = file.seek, file.tell, file.seekable, file.close

    def read(self, size: int = -1) -> bytes:
        """Read as a file does. Raises BadZipFile if there are more than `most` bytes."""
        if self.most is None:
            return self._file.read(size)
        content = self._file.read(self.most + 1 if size < 0 else min(size, self.most + 1))
        if len(content) > self.most:
            raise zipfile.BadZipFile(f"its directory is larger than {self.most >> 20} MiB")
        return content
