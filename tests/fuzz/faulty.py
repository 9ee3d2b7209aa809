"""Readers that break each rule: the fuzzer must report all of them, or its silence would mean nothing."""

import os
import signal
import time
import warnings
from pathlib import Path

import numpy as np

from tests.fuzz.reader import Reader


def _seeds(folder: Path) -> list[bytes]:
    return [b"good"]


def _is_good(path: Path) -> bool:
    """Only the seed is: every damaged file sets off the fault."""
    return path.read_bytes() == b"good"


def _raise(path: Path, words: str) -> None:
    if not _is_good(path):
        raise ValueError(words)


def _crash(path: Path) -> None:
    _is_good(path) or os.kill(os.getpid(), signal.SIGSEGV)


def _hang(path: Path) -> None:
    _is_good(path) or time.sleep(1000)


def _bloat(path: Path) -> None:
    _is_good(path) or b"x" * (130 << 20)


def _claim(path: Path) -> None:
    """Asks for memory, but does not use it."""
    _is_good(path) or np.empty(300 << 20, np.uint8)


def _key(path: Path) -> None:
    _is_good(path) or {}["a"]


def _nameless(path: Path) -> None:
    _raise(path, "something is wrong")


def _lines(path: Path) -> None:
    _raise(path, f"{path}: first\nsecond")


def _flood(path: Path) -> None:
    _raise(path, f"{path}: {'x' * 5000}")


def _warn(path: Path) -> None:
    _is_good(path) or warnings.warn("overflow", RuntimeWarning, stacklevel=1)


def _nan(path: Path) -> np.ndarray:
    return np.full((2, 2), 0.5 if _is_good(path) else np.nan)


_BREAKS = _crash, _hang, _bloat, _claim, _key, _nameless, _lines, _flood, _warn, _nan
READERS = {read.__name__[1:]: Reader(read.__name__[1:], _seeds, file="a.dat", read=read) for read in _BREAKS}
