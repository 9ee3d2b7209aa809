"""USD files, through the package usd-core: a process of its own reads them.

The libraries of USD crash on some damaged files, and know no bounds of time and memory. So another process
opens the stage and writes what is needed of it as plain arrays, see `child`; its crash, hunger or endless
work becomes a sentence.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib.util import find_spec
from math import ceil
from pathlib import Path
from pickle import UnpicklingError
from tempfile import TemporaryDirectory
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError
from brushgs.formats.files import open_plain


class RefusedError(ValueError):
    """A file cannot be used; the text is a clause that follows its name, with the cure."""


PACKAGE = "pxr"  # of usd-core
INSTALL = "pip install 'brushgs[usd]'"
_MIN_SECONDS, _BYTES_A_SECOND = 60, 5_000_000  # that reading may take
_MEMORY = 2 << 30, 24  # bytes of address space, and as many more for each byte of the file
# Windows removes no file that is mapped, and would keep the folder: there arrays are read at once.
_REMOVES_MAPPED = os.name == "posix"
_DAMAGED = "is damaged, or no USD file; export it again"


@dataclass(frozen=True)
class Answer:
    """What was read."""

    header: dict[str, Any]  # what the reader returned
    folder: Path  # where the arrays lie, see `array`

    def array(self, name: str) -> NDArray[Any]:
        """An array that the reader saved, mapped into memory where it can be: it outlives the folder."""
        mode: Literal["r"] | None = "r" if _REMOVES_MAPPED else None
        return np.asarray(np.load(self.folder / f"{name}.npy", mmap_mode=mode, allow_pickle=False))


def is_usd_here() -> bool:
    """Whether the package usd-core is installed."""
    return find_spec(PACKAGE) is not None


@contextmanager
def reading(path: Path, kind: str) -> Iterator[Answer]:
    """What was read of a USD file, "cameras" or "splats"; its arrays may be opened within the block.

    Raises:
        SceneError: if the package is missing, there is no such file, or what is needed cannot be read.
    """
    with open_plain(path, "USD file") as file:
        size = file.seek(0, 2)
    if not size:
        raise SceneError(path, "is empty; copy or download it again")
    if not is_usd_here():
        raise SceneError(path, f"is a USD file, which the package usd-core reads; install it with {INSTALL}")
    with TemporaryDirectory(prefix="brushgs-usd-") as name:
        yield Answer(_header(path, kind, Path(name), size), Path(name))


def _header(path: Path, kind: str, folder: Path, size: int) -> dict[str, Any]:
    from brushgs.core.processes import KilledError, ProcessPool, Ways  # no other file needs threads

    environment = {name: value for name, value in os.environ.items() if not name.startswith("PXR_")}
    # More threads than one need more address space than the bound leaves, and gain nothing here.
    environment |= {"PXR_WORK_THREAD_LIMIT": "1", "MALLOC_ARENA_MAX": "2"}
    seconds = _MIN_SECONDS + size / _BYTES_A_SECOND
    bounds = _MEMORY[0] + _MEMORY[1] * size, ceil(seconds)
    try:
        ways = Ways(1, environment=environment, output="dropped", errors=(RefusedError,))
        with ProcessPool(_read_file, 1, ways) as pool:
            header: dict[str, Any] = pool.submit(0, (kind, path, folder, bounds))(timeout=seconds)
    except TimeoutError:
        fact = f"was not read within {seconds:.0f} s"
        raise SceneError(path, f"{fact}; export only what is needed of it") from None
    except (KilledError, UnpicklingError):
        raise SceneError(path, _DAMAGED) from None
    except RefusedError as error:
        raise SceneError(path, str(error)) from None
    return header


def _read_file(item: tuple[str, Path, Path, tuple[int, int]]) -> dict[str, Any]:
    """Write the arrays of a file as FOLDER/NAME.npy, in the process of its own; the header.

    Raises RefusedError if something is wrong with the file.
    """
    kind, path, folder, bounds = item
    _bound(*bounds)
    try:
        from brushgs.formats.usd import child  # imports the package

        read = {"cameras": child.read_cameras, "splats": child.read_splats}[kind]
        header: dict[str, Any] = read(path, folder)
    except RefusedError:
        raise
    except MemoryError:
        raise RefusedError("needs too much memory; export only what is needed of it") from None
    except Exception:  # of the library, or what it gives cannot be used
        raise RefusedError(_DAMAGED) from None
    return header


def _bound(memory: int, seconds: int) -> None:
    """At most so many bytes of address space and seconds of work, and no core dump.

    Where no process can be bound (Windows), and where the system refuses a bound (macOS, or a lower one
    holds), time alone bounds what a file may cost, for as long as the first process lives.
    """
    try:
        import resource
    except ImportError:
        return
    of_each = ((resource.RLIMIT_AS, memory), (resource.RLIMIT_CPU, seconds + 10), (resource.RLIMIT_CORE, 0))
    for what, bound in of_each:
        with suppress(ValueError, OSError):
            resource.setrlimit(what, (bound, bound))
