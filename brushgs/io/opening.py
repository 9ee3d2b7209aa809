"""Files from outside are opened here: plain files only, of a size that their reader can hold.

A pipe would be waited for without end, a device such as /dev/zero never ends, and a file that is read whole
must be small enough for that. So all readers go through these two functions.
"""

import stat
from pathlib import Path
from typing import BinaryIO

from brushgs.errors import SceneError


def open_plain(path: Path, what: str = "file", *, buffering: int = -1) -> BinaryIO:
    """Open a plain file, or what a link to one leads to, at its first byte.

    Args:
        path: the file.
        what: what is expected there, such as ".ply file", for the messages.
        buffering: as in `open`.

    Raises:
        SceneError: if there is no such file, it is a folder, pipe or device, or may not be read.
    """
    check_plain(path, what)
    try:
        return path.open("rb", buffering=buffering)
    except OSError as error:
        raise _told(path, what, error) from None


def check_plain(path: Path, what: str = "file") -> None:
    """Refuse what `open_plain` would refuse, as far as that shows without opening it. Raises the same."""
    try:
        mode = path.stat().st_mode
    except OSError as error:
        raise _told(path, what, error) from None
    except ValueError:  # a zero byte in the name
        raise SceneError(repr(str(path)), f"there is no such {what.split()[-1]}; check the path") from None
    if stat.S_ISDIR(mode):
        raise _told(path, what, IsADirectoryError())
    if not stat.S_ISREG(mode):
        raise SceneError(path, "is a pipe or device, which cannot be read twice; save it to a file first")


def is_plain(path: Path) -> bool:
    """Whether there is a plain file of that name; a name that no file can have is none."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def read_whole(path: Path, most: int, what: str = "file") -> bytes:
    """The content of a plain file of at most `most` bytes.

    Raises:
        SceneError: see `open_plain`; or if it is larger, which shows before it is read.
    """
    with open_plain(path, what) as file:
        try:
            # One byte more than allowed: some files, and all that grow, are longer than they say.
            content = b"" if path.stat().st_size > most else file.read(most + 1)
            size = max(len(content), path.stat().st_size)
        except OSError as error:
            raise SceneError(path, f"cannot be read ({error.strerror}); check the path") from None
    if size > most:
        rule = f"a {what} must have at most {most >> 20} MiB, got {size / 2**20:.0f}"
        raise SceneError(path, f"{rule}; split it or leave out what is not needed")
    return content


def _told(path: Path, what: str, error: OSError) -> SceneError:
    """A fault of the file system in a sentence."""
    match error:
        case FileNotFoundError():
            return SceneError(path, f"there is no such {what.split()[-1]}; check the path")
        case IsADirectoryError():
            return SceneError(path, f"is a folder; name the {what} inside it")
        case PermissionError():
            return SceneError(path, "may not be read; change its permissions")
    return SceneError(path, f"cannot be opened ({error.strerror}); check the path")
