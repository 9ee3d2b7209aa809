"""Files that appear whole or not at all: written beside their name, renamed when complete."""

import os
import secrets
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from brushgs.errors import SceneError


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """A temporary path to write to; it takes the name `path` when the block ends without an error.

    The temporary file lies in the same folder (a rename across file systems is a copy) and has the
    same suffix. If the block raises, it is removed and what stood at `path` before is untouched. A
    symbolic link stays one: the file it points to is replaced.

    Args:
        path: the name wanted in the end.

    Raises:
        SceneError: if the folder is missing or cannot be written to, or if `path` is a folder or device.
    """
    target = Path(path).resolve()
    if target.exists() and not target.is_file():
        # Renaming onto /dev/null would put a plain file in its place.
        raise SceneError(path, "is not a regular file and cannot be replaced; choose another name")
    temporary = target.with_name(f".{target.stem[:64]}-{secrets.token_hex(4)}{target.suffix}")
    try:
        # Made here with the usual rights of a new file, and so that a folder at fault shows early.
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
    except FileNotFoundError:
        raise SceneError(path, f"the folder {target.parent} does not exist; create it first") from None
    except OSError as error:
        raise SceneError(path, f"cannot be written ({error.strerror}); choose another folder") from None
    try:
        yield temporary
        temporary.replace(target)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise SceneError(path, f"cannot be written ({error.strerror}); check the disk") from error
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


@contextmanager
def unstopped() -> Iterator[None]:
    """Hold Ctrl-C back until the block is done: for short work that must not be left in the middle.

    Python hears signals in its main thread only; in other threads nothing needs to be held back.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    heard: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: heard.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)
        if heard:
            signal.raise_signal(signal.SIGINT)
