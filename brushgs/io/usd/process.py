"""A USD file is read by a process of its own, whose crash, hunger or endless work becomes a sentence."""

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

import brushgs
from brushgs.errors import SceneError
from brushgs.io.files import open_plain

PACKAGE = "pxr"  # of usd-core
INSTALL = "pip install 'brushgs[usd]'"
_MIN_SECONDS, _BYTES_A_SECOND = 60, 5_000_000  # that reading may take
# Windows removes no file that is mapped, and would keep the folder: there arrays are read at once.
_REMOVES_MAPPED = os.name == "posix"
_DAMAGED = "is damaged, or no USD file; export it again"


@dataclass(frozen=True)
class Answer:
    """What was read.

    Attributes:
        header: JSON object.
        folder: where the arrays lie; see `array`.
    """

    header: dict[str, Any]
    folder: Path

    def array(self, name: str) -> NDArray[Any]:
        """An array that the reader saved, mapped into memory where it can be: it outlives the folder."""
        mode: Literal["r"] | None = "r" if _REMOVES_MAPPED else None
        return np.asarray(np.load(self.folder / f"{name}.npy", mmap_mode=mode, allow_pickle=False))


def is_usd_here() -> bool:
    """Whether the package usd-core is installed."""
    return find_spec(PACKAGE) is not None


class Reading:
    """Reads a USD file; used as a context, within which the arrays of its `Answer` may be opened.

    Args:
        path: the file.
        kind: what is read of it: "cameras" or "splats".

    Raises:
        SceneError: if the package is missing, there is no such file, or what is needed cannot be read.
    """

    def __init__(self, path: Path, kind: str) -> None:
        self._path, self._kind = path, kind

    def __enter__(self) -> Answer:
        """Start the process, and wait for it."""
        with open_plain(self._path, "USD file") as file:
            size = file.seek(0, 2)
        if not size:
            raise SceneError(self._path, "is empty; copy or download it again")
        if not is_usd_here():
            raise SceneError(
                self._path, f"is a USD file, which the package usd-core reads; install it with {INSTALL}"
            )
        self._folder = TemporaryDirectory(prefix="brushgs-usd-")
        try:
            return self._read(Path(self._folder.name), size)
        except BaseException:
            self._folder.cleanup()
            raise

    def __exit__(self, *error: object) -> None:
        """Remove the files between the processes."""
        self._folder.cleanup()

    def _read(self, folder: Path, size: int) -> Answer:
        source = str(Path(brushgs.__file__).parents[1])
        environment = {name: value for name, value in os.environ.items() if not name.startswith("PXR_")}
        # More threads than one need more address space than the bound leaves, and gain nothing here.
        environment |= {"PXR_WORK_THREAD_LIMIT": "1", "MALLOC_ARENA_MAX": "2"}
        environment["PYTHONPATH"] = os.pathsep.join([source, *filter(None, [os.environ.get("PYTHONPATH")])])
        # -P: what lies in the working directory is no module.
        command = [
            sys.executable,
            "-P",
            "-m",
            "brushgs.io.usd.child",
            self._kind,
            str(self._path),
            str(folder),
        ]
        seconds = _MIN_SECONDS + size / _BYTES_A_SECOND
        try:
            subprocess.run(
                command,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=seconds,
                check=False,
            )
        except subprocess.TimeoutExpired:
            fact = f"was not read within {seconds:.0f} s"
            raise SceneError(self._path, f"{fact}; export only what is needed of it") from None
        try:
            header = json.loads((folder / "header.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):  # it crashed, or memory ended
            raise SceneError(self._path, _DAMAGED) from None
        if "error" in header:
            raise SceneError(self._path, header["error"])
        return Answer(header, folder)
