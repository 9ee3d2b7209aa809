"""Where the files of a SOG scene lie: in a folder, or in a zip archive, of which nothing is trusted.

Members of an archive are found by name. Their pictures are copied to a temporary folder, under a name of our
own, while they are decoded, since the decoder reads named files only; nothing else reaches the disk.
"""

import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import Protocol

from brushgs.errors import SceneError
from brushgs.formats.files import find_within, is_dir, is_plain, open_plain, read_whole, scratch_folder
from brushgs.formats.pictures.webp import NUM_HEADER_BYTES
from brushgs.formats.zip_file import ZIP_FAULTS, open_zip, why_not_read

META = "meta.json"
_SHOWN_MEMBERS = 3


class SceneFiles(Protocol):
    """Files of one scene, by the names that its `meta.json` gives them."""

    path: Path  # of the file that messages name

    def meta(self, most: int) -> bytes:
        """The `meta.json`, whatever it is called. Raises SceneError."""

    def head(self, name: str) -> bytes:
        """The first bytes of a file, enough for the size of a WebP picture. Raises SceneError."""

    def size(self, name: str) -> int:
        """Bytes that a file takes as it is stored, packed or not. Raises SceneError."""

    @contextmanager
    def on_disk(self, name: str, most: int) -> Iterator[Path]:
        """A path to a file of at most `most` bytes while the context is open. Raises SceneError."""


class Folder:
    """The files beside a `meta.json`."""

    def __init__(self, meta: Path) -> None:
        self.path = meta

    def meta(self, most: int) -> bytes:
        """See `SceneFiles`."""
        return read_whole(self.path, most)

    def head(self, name: str) -> bytes:
        """See `SceneFiles`."""
        with open_plain(self._find(name)) as file:
            return file.read(NUM_HEADER_BYTES)

    def size(self, name: str) -> int:
        """See `SceneFiles`."""
        return self._find(name).stat().st_size

    @contextmanager
    def on_disk(self, name: str, most: int) -> Iterator[Path]:
        """See `SceneFiles`."""
        path = self._find(name)
        if path.stat().st_size > most:
            raise SceneError(path, _too_large(most))
        yield path

    def _find(self, name: str) -> Path:
        path = find_within(self.path.parent, name, self.path)
        if not is_plain(path):
            fact = f"names the file {name[:100]!r}, which is not there"
            raise SceneError(self.path, f"{fact}; copy the whole folder of the scene")
        return path


class Archive:
    """The members of a zip archive that lie beside its `meta.json`."""

    def __init__(self, path: Path, archive: zipfile.ZipFile, folder: str) -> None:
        self.path, self._archive, self._folder = path, archive, folder

    def meta(self, most: int) -> bytes:
        """See `SceneFiles`."""
        return self._read_whole(META, most)

    def head(self, name: str) -> bytes:
        """See `SceneFiles`."""
        return self._read(self._find(name), NUM_HEADER_BYTES)

    def size(self, name: str) -> int:
        """See `SceneFiles`."""
        return self._find(name).compress_size

    @contextmanager
    def on_disk(self, name: str, most: int) -> Iterator[Path]:
        """See `SceneFiles`."""
        content = self._read_whole(name, most)
        with scratch_folder() as folder:
            path = folder / "picture.webp"
            path.write_bytes(content)
            try:
                yield path
            except SceneError as error:  # names the temporary file
                message = str(error).removeprefix(f"{path}: ")
                raise SceneError(self.path, f"its member {name[:100]!r} {message}") from None

    def _find(self, name: str) -> zipfile.ZipInfo:
        try:
            member = self._archive.getinfo(self._folder + name)
        except KeyError:
            fact = f"names the file {name[:100]!r}, which is not in the archive"
            raise SceneError(self.path, f"its {META} {fact}; download or export it again") from None
        if how := why_not_read(member):
            raise SceneError(self.path, f"its member {name[:100]!r} {how}; unpack it and name the folder")
        return member

    def _read_whole(self, name: str, most: int) -> bytes:
        content = self._read(self._find(name), most + 1)
        if len(content) > most:
            raise SceneError(self.path, f"its member {name[:100]!r} {_too_large(most)}")
        return content

    def _read(self, member: zipfile.ZipInfo, most: int) -> bytes:
        """At most so many bytes; a member that is read to its end is checked against its checksum."""
        try:
            with self._archive.open(member) as file:
                return file.read(most)
        except ZIP_FAULTS as error:
            fact = f"its member {member.filename[:100]!r} is damaged ({error})"
            raise SceneError(self.path, f"{fact}; download or copy it again") from None


@contextmanager
def open_files(path: Path) -> Iterator[SceneFiles]:
    """The files of a SOG scene, given a folder, the `meta.json` in one, or a zip archive.

    Raises:
        SceneError: see `_open_archive`.
    """
    if is_dir(path):
        yield Folder(path / META)
        return
    with open_plain(path, "scene file") as file:
        is_archive = file.read(2) == b"PK"
    if not is_archive:
        yield Folder(path)
        return
    with _open_archive(path) as archive:
        yield archive


@contextmanager
def _open_archive(path: Path) -> Iterator[Archive]:
    """The SOG scene in a zip archive.

    Raises:
        SceneError: if the archive is damaged, has a huge directory or holds no `meta.json` or several; says
            what it holds.
    """
    with open_zip(path) as archive:
        yield Archive(path, archive, _find_folder(path, archive.namelist()))


def _find_folder(path: Path, names: list[str]) -> str:
    """The folder inside an archive that holds the scene, with its "/"; "" for the top."""
    metas = [name for name in names if PurePosixPath(name).name == META]
    if META in metas:
        return ""
    if len(metas) == 1:
        return metas[0][: -len(META)]
    if any(PurePosixPath(name).name == "lod-meta.json" for name in names):
        raise SceneError(
            path, "is a zip archive of a streamed SOG scene; unpack it and name its lod-meta.json"
        )
    if metas:
        what = f"{len(metas)} SOG scenes in folders of their own"
        raise SceneError(path, f"is a zip archive of {what}; unpack it and name the {META} of one")
    files = [name for name in names if not name.endswith("/")]
    if not files:
        raise SceneError(path, "is a zip archive without files; download or export it again")
    few = ", ".join(repr(name[:60]) for name in files[:_SHOWN_MEMBERS])
    more = f" and {len(files) - _SHOWN_MEMBERS} more" if len(files) > _SHOWN_MEMBERS else ""
    fact = f"is a zip archive without a SOG scene: it holds {few}{more}"
    raise SceneError(path, f"{fact}; unpack it and name the scene inside")


def _too_large(most: int) -> str:
    """The end of a sentence."""
    return f"must have at most {most / 2**20:.1f} MiB, got more; download or export it again"
