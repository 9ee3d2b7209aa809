"""Read untrusted zip archives: the size of the directory is limited, and every fault is a SceneError."""

import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, BinaryIO

from brushgs.errors import SceneError
from brushgs.formats.files import open_plain

# Most bytes of a directory: 20,000 entries, which take 12 MB in memory. Scenes have about ten.
_MAX_DIRECTORY_BYTES = 1 << 20
_PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # others may ask for gigabytes of memory
# Errors that reading an archive or a member may raise.
ZIP_FAULTS = (zipfile.BadZipFile, zlib.error, EOFError, OSError, RuntimeError, ValueError)


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


@contextmanager
def open_member(
    path: Path, archive: zipfile.ZipFile, member: zipfile.ZipInfo, what: str, cure: str
) -> Iterator[IO[bytes]]:
    """Open a member of an archive; `what` names it in messages, such as "array 'means3D'".

    Raises SceneError, with the given cure, if it is encrypted or in an unsupported compression; or if it
    proves damaged while it is read within the block. A checksum is verified at the end of a member.
    """
    if member.flag_bits & 1:
        raise SceneError(path, f"its {what} is encrypted; {cure}")
    if member.compress_type not in _PACKINGS:
        raise SceneError(path, f"its {what} is packed in a way that is not read; {cure}")
    try:
        with archive.open(member) as file:
            yield file
    except SceneError:
        raise
    except ZIP_FAULTS as error:
        fact = f"its {what} is damaged ({str(error) or 'it is cut off'})"
        raise SceneError(path, f"{fact}; download or copy it again") from None


def read_member(
    path: Path, archive: zipfile.ZipFile, name: str, most: int, *, lacks: str, cure: str
) -> bytes:
    """The content of a member of an archive.

    Raises SceneError as `open_member` does; if it is larger than `most` bytes; or, saying `lacks`, if there
    is no such member.
    """
    try:
        member = archive.getinfo(name)
    except KeyError:
        raise SceneError(path, lacks) from None
    if member.file_size > most:
        raise SceneError(path, f"its {name[:80]} is larger than {most >> 20} MiB; {cure}")
    with open_member(path, archive, member, name[:80], cure) as file:
        return file.read(most)


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
