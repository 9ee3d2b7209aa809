"""How much memory this process may use, decided in one place."""

import os
from pathlib import Path

# Where Linux states the limit of a container, of control groups of version 2 and 1.
_LIMIT_FILES = "/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"


def machine_memory() -> int | None:
    """Bytes of memory of this machine, or of the container or the limit that the process runs in.

    It is that which there is, and not that which is free at the moment: what is painted may depend on it.
    None where the system tells nothing, as on Windows.
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
    """The number in a file; None where there is no file, or a word such as "max"."""
    try:
        return int(Path(path).read_text())
    except (OSError, ValueError):
        return None
