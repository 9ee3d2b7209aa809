"""Open user files if they are regular and not too large; write files completely or not at all.

All readers open their files here, because opening a pipe may block forever, a device such as /dev/zero never
ends, and a file that is read whole must be small enough. Output goes to a temporary name beside the target
and is renamed when complete. An output folder is made when the first file is written into it.
"""

import errno
import json
import os
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Any, BinaryIO

from brushgs.core.signals import defer_stop
from brushgs.errors import SceneError

_noting: list[set[Path]] = []  # sets of open `noting_written` blocks, shared by all threads that write
_DENIED = {errno.EACCES, errno.EPERM, errno.EROFS}
_NO_PLACE = {errno.ENOENT, errno.ENOTDIR, errno.ENAMETOOLONG, errno.ELOOP}
_FULL = {errno.ENOSPC, errno.EFBIG, *([errno.EDQUOT] if hasattr(errno, "EDQUOT") else [])}


def open_plain(path: Path, what: str = "file", *, buffering: int = -1) -> BinaryIO:
    """Open a regular file, or the target of a link, at its first byte.

    `what` names the expected file in messages, such as "scene file"; `buffering` is as in `open`.

    Raises:
        SceneError: if the file does not exist, is a folder, pipe or device, or may not be read.
    """
    check_plain(path, what)
    try:
        return path.open("rb", buffering=buffering)
    except OSError as error:
        raise _scene_error(path, what, error) from None


def check_plain(path: Path, what: str = "file") -> None:
    """Raise the errors of `open_plain` that can be detected without opening the file."""
    try:
        mode = path.stat().st_mode
    except OSError as error:
        raise _scene_error(path, what, error) from None
    except ValueError:  # a zero byte in the name
        raise SceneError(repr(str(path)), f"there is no such {what.split()[-1]}; check the path") from None
    if stat.S_ISDIR(mode):
        raise _scene_error(path, what, IsADirectoryError())
    if not stat.S_ISREG(mode):
        raise SceneError(path, "is a pipe or device, which cannot be read twice; save it to a file first")


# For a name that no file can have, these return False, where `Path.is_file` and the like raise.
is_plain, is_dir, exists = os.path.isfile, os.path.isdir, os.path.exists


def find_within(folder: Path, name: str, named_by: Path) -> Path:
    """The path of a file in or below `folder`, by a relative name found in the untrusted file `named_by`.

    Raises:
        SceneError: if the name leads out of the folder. It is not checked whether the file exists.
    """
    parts = PurePosixPath(name).parts
    is_inside = bool(parts) and not name.startswith("/") and ".." not in parts
    if not is_inside or "\\" in name or "\0" in name or ":" in parts[0]:
        fact = f"names the file {name[:100]!r}, which lies outside its folder"
        raise SceneError(named_by, f"{fact}; put it beside this file and name it so")
    return folder.joinpath(*parts)


def read_whole(path: Path, most: int, what: str = "file") -> bytes:
    """The content of a regular file of at most `most` bytes.

    Raises SceneError as `open_plain` does, or if the file is larger; its size is checked before reading.
    """
    with open_plain(path, what) as file:
        try:
            # Read one byte more than allowed: growing and some special files exceed their stated size.
            content = b"" if path.stat().st_size > most else file.read(most + 1)
            size = max(len(content), path.stat().st_size)
        except OSError as error:
            raise SceneError(path, f"cannot be read ({error.strerror}); check the path") from None
    if size > most:
        rule = f"a {what} must have at most {most >> 20} MiB, got {size / 2**20:.0f}"
        raise SceneError(path, f"{rule}; split it or remove what is not needed")
    return content


def read_exactly(path: Path, file: BinaryIO, start: int, target: memoryview) -> None:
    """Fill a byte buffer from byte `start` of an open file whose size was checked before.

    Raises SceneError if the file became shorter in the meantime.
    """
    file.seek(start)
    done = 0
    while done < len(target):
        count = file.readinto(target[done:])  # type: ignore[attr-defined]
        if not count:
            raise SceneError(path, "became shorter while it was read; load it when it is complete")
        done += count


def cut_off(path: Path, where: str) -> SceneError:
    """The error for a file that ends too early; `where` says at which place."""
    return SceneError(path, f"is cut off: {where}; download or copy it again")


def damaged(path: Path, fact: str) -> SceneError:
    """The error for a file whose bytes contradict each other."""
    return SceneError(path, f"is damaged: {fact}; download or copy it again")


def _scene_error(path: Path, what: str, error: OSError) -> SceneError:
    """The SceneError for an error of the file system."""
    match error:
        case FileNotFoundError():
            return SceneError(path, f"there is no such {what.split()[-1]}; check the path")
        case IsADirectoryError():
            return SceneError(path, f"is a folder; name the {what} inside it")
        case PermissionError():
            return SceneError(path, "may not be read; change its permissions")
    return SceneError(path, f"cannot be opened ({error.strerror}); check the path")


@contextmanager
def noting_written() -> Iterator[set[Path]]:
    """Yield a set that collects the files completed within the block by `replacing` and `filling`."""
    written: set[Path] = set()
    _noting.append(written)
    try:
        yield written
    finally:
        _noting[:] = [other for other in _noting if other is not written]


def note_written(*paths: Path) -> None:
    """Add files to the sets of `noting_written`, such as files kept from an earlier run."""
    for written in _noting:
        written.update(path.absolute() for path in paths)


@contextmanager
def folder_made(folder: Path, path: str | Path) -> Iterator[None]:
    """Make `folder` (an absolute path) and its missing parents; `path` names the output in messages.

    If the block raises, the made folders are removed if empty. Raises SceneError if one cannot be made.
    """
    missing = [one for one in (folder, *folder.parents) if not one.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield
    except BaseException as error:
        for one in missing:
            with suppress(OSError):
                one.rmdir()
        if isinstance(error, OSError):
            named = "the folder" if folder == Path(path).absolute() else f"the folder {folder}"
            fact = f"{named} cannot be made ({error.strerror})"
            raise SceneError(path, f"{fact}; choose another folder") from None
        raise


@contextmanager
def replacing(path: str | Path, most: int = 0) -> Iterator[Path]:
    """Yield a temporary path to write to; it is renamed to `path` when the block ends without an error.

    The temporary file has the same suffix and lies in the same folder (a rename across file systems is a
    copy), which is made if missing. If the block raises, the temporary file is removed and an earlier file at
    `path` is untouched. A symbolic link stays a link: its target is replaced.

    Args:
        path: the final name.
        most: bytes of disk space that must be free before anything is written, for libraries that hang or
            end the process when the disk is full.

    Raises:
        SceneError: if the folder cannot be made or written to, if `path` is a folder or device, or if the
            disk is full.
    """
    target = Path(path).resolve()
    if target.exists() and not target.is_file():
        # Renaming onto /dev/null would put a plain file in its place.
        raise SceneError(path, "is not a regular file and cannot be replaced; choose another name")
    temporary = target.with_name(f".{target.stem[:64]}-{os.urandom(4).hex()}{target.suffix}")
    with folder_made(target.parent, path), _undone(path, partial(temporary.unlink, missing_ok=True)):
        # Create it here to get the permissions of a new file, and to detect an unusable folder early.
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        _check_room(temporary, most)
        yield temporary
        temporary.replace(target)
        note_written(target)


@contextmanager
def _undone(path: str | Path, undo: Callable[[], object]) -> Iterator[None]:
    """If the block raises, call `undo`; errors of the file system become SceneErrors about `path`."""
    try:
        yield
    except BaseException as error:
        with suppress(OSError):  # the folder may be unusable
            undo()
        if isinstance(error, OSError):
            cure = "choose another folder" if error.errno in _DENIED | _NO_PLACE else "check the disk"
            raise SceneError(path, f"cannot be written ({error.strerror}); {cure}") from error
        raise


def _check_room(file: Path, most: int) -> None:
    """Raise OSError if the disk has no room for a file of `most` bytes."""
    if not hasattr(os, "posix_fallocate"):  # macOS and Windows
        if shutil.disk_usage(file.parent).free < most:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    elif most:
        with file.open("wb") as target:
            try:
                os.posix_fallocate(target.fileno(), 0, most)
            except OSError as error:
                if error.errno in _FULL:  # other errors: the file system cannot tell
                    raise
            target.truncate(0)


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """Yield a temporary folder, removed at the end, for libraries that read and write named files only.

    Raises:
        SceneError: if the folder cannot be made, or its disk is full.
    """
    try:
        with tempfile.TemporaryDirectory(prefix="brushgs-") as name:
            try:
                yield Path(name)
            except SceneError as error:
                if error.path.parent != Path(name) or not isinstance(error.__cause__, OSError):
                    raise
                raise error.__cause__ from None
    except OSError as error:
        if error.errno not in _FULL:
            raise
        cure = "make room there, or set TMPDIR to another folder"
        raise SceneError(tempfile.gettempdir(), f"has no room for temporary files; {cure}") from None


@contextmanager
def on_disk(path: Path, content: bytes, name: str, what: str) -> Iterator[Path]:
    """Yield a temporary file with a part of the file `path`, for decoders that read named files only.

    A SceneError about it becomes one about `path`; `what` names the part, such as "its member 'a.webp'".
    """
    with scratch_folder() as folder:
        file = folder / name
        file.write_bytes(content)
        try:
            yield file
        except SceneError as error:
            if error.path != file:
                raise
            raise SceneError(path, f"{what} {error.message}") from None


@contextmanager
def filling(folder: Path, goes: Callable[[Path], bool]) -> Iterator[Path]:
    """Yield a temporary folder; its files move into `folder` when the block ends without an error.

    The temporary folder lies inside `folder`, so that moving is renaming even if `folder` is a disk of its
    own, and its name is hidden, so that readers skip it. If the block raises, it is removed and `folder` is
    unchanged.

    Args:
        folder: the target, made if it is missing.
        goes: whether an existing file in `folder` is removed: true for files with the name of a new file, and
            for files that belong to replaced ones.

    Raises:
        SceneError: if the folder cannot be made or written to.
    """
    temporary = folder / f".unfinished-{os.urandom(4).hex()}"
    clear = partial(shutil.rmtree, temporary, ignore_errors=True)
    with folder_made(folder.absolute(), folder), _undone(folder, clear):
        temporary.mkdir()
        yield temporary
        with defer_stop():  # renaming takes milliseconds
            for path in folder.iterdir():
                if goes(path):
                    path.unlink()
            for path in sorted(temporary.iterdir()):
                path.replace(folder / path.name)
                note_written(folder / path.name)
            temporary.rmdir()


# A record of finished items, from which `--resume` finds the remaining ones: JSON lines, first a heading,
# then one line for each item, added when the item is finished, so a stopped run loses nothing. The last line
# may be cut off.
_RECORD_BYTES, _RECORD_LINES = 8 << 20, 200_000  # limits of a record; a path has at most 99,999 frames


def read_record(
    path: Path, key: str, fault: str, most: int = _RECORD_BYTES
) -> tuple[dict[str, Any], list[dict[str, Any]]] | None:
    """The object under `key` in the heading of a record, and its entries; None if the file does not exist.

    Raises SceneError if the file cannot be read or has more than `most` bytes, or with the message `fault` if
    it is no such record.
    """
    try:
        path.stat()
    except FileNotFoundError:
        return None
    except OSError:
        pass  # reported when it is opened
    first, *lines = (_parsed(line) for line in read_whole(path, most).splitlines() or [b""])
    heading = first.get(key) if len(lines) <= _RECORD_LINES else None
    if not isinstance(heading, dict):
        raise SceneError(path, fault)
    return heading, [line for line in lines if line]


def begin_record(path: Path, heading: Mapping[str, Any], entries: Iterable[Mapping[str, Any]]) -> None:
    """Start a new record. Raises SceneError if it cannot be written."""
    with replacing(path) as temporary:
        lines = (f"{json.dumps(line)}\n" for line in (heading, *entries))
        temporary.write_text("".join(lines), encoding="utf-8")


def add_to_record(path: Path, entry: Mapping[str, Any]) -> None:
    """Append the line of a finished item. Raises SceneError if it cannot be written."""
    try:
        with path.open("a", encoding="utf-8") as record:
            record.write(f"{json.dumps(entry)}\n")
    except OSError as error:
        raise SceneError(path, f"cannot be written ({error.strerror}); check the disk") from None


def _parsed(line: bytes) -> dict[str, Any]:
    """The object of a line; an empty dict if the line is cut off or is no object."""
    try:
        value = json.loads(line)
    except (ValueError, RecursionError):
        return {}
    return value if isinstance(value, dict) else {}
