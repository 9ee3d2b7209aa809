"""The memory of this process: its limit, decided in one place, and what becomes of memory that is freed."""

import os
import sys
from pathlib import Path

# Memory limits of Linux containers (control groups version 2 and 1).
_LIMIT_FILES = "/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # parameters of mallopt, of malloc.h of the GNU C library
KEPT = (1 << 31) - 1  # bytes: the most that can be asked for; with 512 MB plain views were cleared anew


def machine_memory() -> int | None:
    """Total bytes of memory of this machine, or of the container or limit of the process.

    Not the free memory, since paintings may depend on it. None if unknown, as on Windows.
    """
    known = [_physical(), _address_space(), *map(_stated, _LIMIT_FILES)]
    return min((size for size in known if size is not None), default=None)


def keep_freed() -> None:
    """Let this process reuse freed arrays, up to `KEPT` bytes, instead of returning each to the system.

    For large scenes, until the process ends. The system clears all pages that it hands out: with five
    million Gaussians this was 3/10 of the processor time of a painting. Only with the GNU C library;
    elsewhere nothing changes.
    """
    if not sys.platform.startswith("linux"):
        return
    import ctypes

    if (mallopt := getattr(ctypes.CDLL(None), "mallopt", None)) is not None:
        mallopt(_MMAP_THRESHOLD, KEPT)
        mallopt(_TRIM_THRESHOLD, KEPT)


def _physical() -> int | None:
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):  # no such function, or no such name
        return None


def _address_space() -> int | None:
    try:
        import resource
    except ImportError:  # Windows
        return None
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    return None if limit == resource.RLIM_INFINITY else limit


def _stated(path: str) -> int | None:
    """The number in a file; None without a file or number (such as "max")."""
    try:
        return int(Path(path).read_text())
    except (OSError, ValueError):
        return None
