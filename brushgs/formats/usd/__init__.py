"""Read USD files with the package usd-core, in a separate process.

The USD libraries crash on some damaged files, and have no limits of time and memory. So a child process opens
the stage and writes the required data as plain arrays, see `child`; if it crashes, or exceeds its time or
memory, a SceneError is raised.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from math import ceil
from pathlib import Path
from pickle import UnpicklingError
from tempfile import TemporaryDirectory
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError
from brushgs.formats.files import open_plain


class RefusedError(ValueError):
    """A file cannot be used; the text is the message after its name, with the cure."""


PACKAGE = "pxr"  # of usd-core
TYPE = "ParticleField3DGaussianSplat"  # of the prims that hold splats
INSTALL = "pip install 'brushgs[usd]'"
_MIN_SECONDS, _BYTES_A_SECOND = 60, 5_000_000  # time limit: a minimum, and a reading speed beyond it
_MEMORY = 2 << 30, 24  # memory limit: bytes of address space, and additional bytes per byte of the file
# Windows cannot remove mapped files and would keep the folder, so there arrays are read into memory.
_REMOVES_MAPPED = os.name == "posix"
_DAMAGED = "is damaged, or no USD file; export it again"


class Answer(NamedTuple):
    """The data read from a USD file."""

    header: dict[str, Any]  # the result of the reader in `child`
    folder: Path  # folder of the arrays, see `array`

    def array(self, name: str) -> NDArray[Any]:
        """An array saved by the reader, memory-mapped where possible; it stays valid without the folder."""
        mode: Literal["r"] | None = "r" if _REMOVES_MAPPED else None
        return np.asarray(np.load(self.folder / f"{name}.npy", mmap_mode=mode, allow_pickle=False))


def is_usd_here() -> bool:
    """Whether the package usd-core is installed."""
    return find_spec(PACKAGE) is not None


@contextmanager
def reading(path: Path, kind: str) -> Iterator[Answer]:
    """Read the "cameras" or "splats" of a USD file; arrays must be opened within the block.

    Raises:
        SceneError: if usd-core is missing, there is no such file, or it cannot be read.
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
    # More threads would need more address space than the limit allows, and gain nothing here.
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
    """In the child process, write the arrays of a file as FOLDER/NAME.npy and return the header.

    Raises RefusedError if the file cannot be used.
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
    except Exception:  # an error of the library, or unusable results
        raise RefusedError(_DAMAGED) from None
    return header


def _bound(memory: int, seconds: int) -> None:
    """Limit this process to `memory` bytes of address space and `seconds` + 10 of CPU time; no core dump.

    If limits are not supported (Windows) or are refused (macOS, or a lower one is set), only the timeout of
    the parent process limits the cost, while that process lives.
    """
    try:
        import resource
    except ImportError:
        return
    of_each = ((resource.RLIMIT_AS, memory), (resource.RLIMIT_CPU, seconds + 10), (resource.RLIMIT_CORE, 0))
    for what, bound in of_each:
        with suppress(ValueError, OSError):
            resource.setrlimit(what, (bound, bound))
