"""Files of users: opened if they are regular files and not too large, written completely or not at all.

Opening a pipe may block forever, a device such as /dev/zero never ends, and a file that is read at once must
be small enough for that: so all readers open their files here. Output goes to a temporary name beside the
target, and is renamed when complete. Folders of outputs are made when the first file is written into them.
"""

import errno
import json
import os
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path, PurePosixPath
from typing import Any, BinaryIO

from brushgs.core.signals import defer_stop
from brushgs.errors import SceneError

_noting: list[set[Path]] = []  # of `noting_written`, all threads: pictures are written in several
_FULL = {errno.ENOSPC, errno.EFBIG, *([errno.EDQUOT] if hasattr(errno, "EDQUOT") else [])}


def open_plain(path: Path, what: str = "file", *, buffering: int = -1) -> BinaryIO:
    """Open a regular file, or the one that a link leads to, at its first byte.

    `what` is expected there, such as "scene file", for the messages; `buffering` is as in `open`.

    Raises:
        SceneError: if there is no such file, it is a folder, pipe or device, or may not be read.
    """
    check_plain(path, what)
    try:
        return path.open("rb", buffering=buffering)
    except OSError as error:
        raise _scene_error(path, what, error) from None


def check_plain(path: Path, what: str = "file") -> None:
    """Refuse what `open_plain` would refuse, as far as is known without opening it. Raises the same."""
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


# These are False, and raise nothing, for a name that no file can have: `Path.is_file` and the like do.
is_plain, is_dir, exists = os.path.isfile, os.path.isdir, os.path.exists


def find_within(folder: Path, name: str, named_by: Path) -> Path:
    """The file of a name that the untrusted file `named_by` mentions, in a folder or in one inside that.

    Raises:
        SceneError: if the name leads out of the folder; whether there is such a file is not checked.
    """
    parts = PurePosixPath(name).parts
    is_inside = bool(parts) and not name.startswith("/") and ".." not in parts
    if not is_inside or "\\" in name or "\0" in name or ":" in parts[0]:
        fact = f"names the file {name[:100]!r}, which lies outside its folder"
        raise SceneError(named_by, f"{fact}; put it beside this file and name it so")
    return folder.joinpath(*parts)


def read_whole(path: Path, most: int, what: str = "file") -> bytes:
    """The content of a regular file of at most `most` bytes.

    Raises SceneError as `open_plain` does; or if it is larger, which is checked before it is read.
    """
    with open_plain(path, what) as file:
        try:
            # One byte more than allowed: growing and some special files are longer than stated.
            content = b"" if path.stat().st_size > most else file.read(most + 1)
            size = max(len(content), path.stat().st_size)
        except OSError as error:
            raise SceneError(path, f"cannot be read ({error.strerror}); check the path") from None
    if size > most:
        rule = f"a {what} must have at most {most >> 20} MiB, got {size / 2**20:.0f}"
        raise SceneError(path, f"{rule}; split it or remove what is not needed")
    return content


def read_exactly(path: Path, file: BinaryIO, start: int, target: memoryview) -> None:
    """Fill a buffer of bytes from byte `start` of an open file, which was known to be long enough.

    Raises SceneError if it became shorter in the meantime.
    """
    file.seek(start)
    done = 0
    while done < len(target):
        count = file.readinto(target[done:])  # type: ignore[attr-defined]
        if not count:
            raise SceneError(path, "became shorter while it was read; load it when it is complete")
        done += count


def _scene_error(path: Path, what: str, error: OSError) -> SceneError:
    """An error of the file system in a sentence."""
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
    """All files that are written within the block, completely: by `replacing` and `filling`."""
    written: set[Path] = set()
    _noting.append(written)
    try:
        yield written
    finally:
        _noting[:] = [other for other in _noting if other is not written]


def note_written(*paths: Path) -> None:
    """Let files be among those of `noting_written`, such as those that stand from an earlier run."""
    for written in _noting:
        written.update(path.absolute() for path in paths)


@contextmanager
def folder_made(folder: Path, path: str | Path) -> Iterator[None]:
    """Make a missing folder, given absolutely, and those above it, for the output that `path` names.

    They are removed, if empty, where the block raises. Raises SceneError if it cannot be made.
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
            fact = f"{named} cannot be made ({error.strerror}); choose another folder"
            raise SceneError(path, fact) from None
        raise


@contextmanager
def replacing(path: str | Path, most: int = 0) -> Iterator[Path]:
    """A temporary path to write to; it takes the name `path` when the block ends without an error.

    The temporary file is in the same folder (a rename across file systems is a copy), which is made if it is
    missing, and has the same suffix. If the block raises, it is removed and an earlier file at `path` is
    untouched. A symbolic link stays one: the file it points to is replaced.

    Args:
        path: the final name.
        most: bytes that the disk must have room for before anything is written, for libraries that hang or
            end the process where it is full.

    Raises:
        SceneError: if the folder cannot be made or written to, if `path` is a folder or device, or if the
            disk is full.
    """
    target = Path(path).resolve()
    if target.exists() and not target.is_file():
        # Renaming onto /dev/null would put a plain file in its place.
        raise SceneError(path, "is not a regular file and cannot be replaced; choose another name")
    temporary = target.with_name(f".{target.stem[:64]}-{os.urandom(4).hex()}{target.suffix}")
    with folder_made(target.parent, path):
        cure = "choose another folder"
        try:
            # Created here to get the permissions of a new file, and to detect an unusable folder early.
            os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
            cure = "check the disk"
            _check_room(temporary, most)
            yield temporary
            temporary.replace(target)
            note_written(target)
        except BaseException as error:
            with suppress(OSError):  # of a folder that cannot be used
                temporary.unlink(missing_ok=True)
            if isinstance(error, OSError):
                raise SceneError(path, f"cannot be written ({error.strerror}); {cure}") from error
            raise


def _check_room(file: Path, most: int) -> None:
    """Raises OSError if a file cannot have so many bytes."""
    if not hasattr(os, "posix_fallocate"):  # macOS and Windows
        if shutil.disk_usage(file.parent).free < most:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    elif most:
        with file.open("wb") as target:
            try:
                os.posix_fallocate(target.fileno(), 0, most)
            except OSError as error:
                if error.errno in _FULL:  # and not where a file system cannot tell
                    raise
            target.truncate(0)


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """A folder for temporary files, removed at the end: some libraries read and write named files only.

    Raises:
        SceneError: if it cannot be made, or its disk is full.
    """
    base = Path(tempfile.gettempdir())
    cure = "make room there, or set TMPDIR to another folder"
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
        raise SceneError(base, f"has no room for temporary files; {cure}") from None


@contextmanager
def filling(folder: Path, goes: Callable[[Path], bool]) -> Iterator[Path]:
    """A temporary folder; its files move into `folder` when the block ends without an error.

    It lies in `folder` and its name is hidden, so that readers pass over it, and that moving is renaming also
    where `folder` is a disk of its own. If the block raises, it is removed, and `folder` is as it was.

    Args:
        folder: made if it is missing.
        goes: whether a file that lies in `folder` before is removed: what has the name of a new file, and
            what belongs to those that are replaced.

    Raises:
        SceneError: if the folder cannot be made or written to.
    """
    temporary = folder / f".unfinished-{os.urandom(4).hex()}"
    with folder_made(folder.absolute(), folder):
        cure = "choose another folder"
        try:
            temporary.mkdir()
            cure = "check the disk"
            yield temporary
            with defer_stop():  # renaming takes milliseconds
                for path in folder.iterdir():
                    if goes(path):
                        path.unlink()
                for path in sorted(temporary.iterdir()):
                    path.replace(folder / path.name)
                    note_written(folder / path.name)
                temporary.rmdir()
        except BaseException as error:
            shutil.rmtree(temporary, ignore_errors=True)
            if isinstance(error, OSError):
                raise SceneError(folder, f"cannot be written ({error.strerror}); {cure}") from error
            raise


# A record of what is done, by which `--resume` knows what is left: JSON lines, a heading, then one a thing,
# which is added when it is done: a run that is stopped loses nothing. The last line may be cut off.
_RECORD_BYTES, _RECORD_LINES = 8 << 20, 200_000  # of a record; a path has at most 99,999 frames


def read_record(
    path: Path, key: str, fault: str, most: int = _RECORD_BYTES
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
    heading = first.get(key) if len(lines) <= _RECORD_LINES else None
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
