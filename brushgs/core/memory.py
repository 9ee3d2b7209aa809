"""The memory limit of this process, decided in one place."""

import os
from pathlib import Path

# Memory limits of Linux containers (control groups version 2 and 1).
_LIMIT_FILES = "/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"


def machine_memory() -> int | None:
    """Total bytes of memory of this machine, or of the container or limit of the process.

    Not the free memory, since paintings may depend on it. None if unknown, as on Windows.
    """
    known = [_physical(), _address_space(), *map(_stated, _LIMIT_FILES)]
    return min((size for size in known if size is not None), default=None)


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
