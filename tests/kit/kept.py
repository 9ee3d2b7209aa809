"""Results that the commands of one session of tests share, in all its processes.

Most tests paint the same few scenes, each in a folder of its own. Pictures are the same bits with kept
results and without them (`tests/pipeline/test_kept.py`), so the first test makes what the others find. Files
count by name and content here, not by folder and time.
"""

import hashlib
import os
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest

from brushgs.pipeline import kept

OF_NAME, MOST_HASHED = kept._of_name, kept.MOST_HASHED  # as users have them
_SHARED = "BRUSHGS_TESTS_KEPT"  # environment variable: the folder, for processes that this one starts
_MOST_READ = 1 << 24  # bytes; of larger files, real scenes, no test has a copy
_is_owner = _SHARED not in os.environ
FOLDER = os.environ.get(_SHARED) or tempfile.mkdtemp(prefix="brushgs_tests_")


def share() -> None:
    """Have commands of this process, and of those that it starts, keep results in the folder."""
    os.environ[_SHARED] = os.environ[kept.FOLDER] = FOLDER
    kept._of_name = of_content
    kept.MOST_HASHED = 1 << 24


def remove() -> None:
    """Remove the folder at the end of the process that made it."""
    if _is_owner:
        shutil.rmtree(FOLDER, ignore_errors=True)


def of_content(value: str | Path) -> bytes:
    """Stands in for `kept._of_name`: a file counts by its name and content."""
    path = Path(value)
    try:
        if path.is_file() and path.stat().st_size <= _MOST_READ:
            return path.name.encode() + hashlib.blake2b(path.read_bytes()).digest()
    except (OSError, ValueError):  # text that is too long for a name, or with a null byte
        pass
    return OF_NAME(value)


def guard() -> None:
    """From here on, a test that replaces a part of the program neither finds results there nor leaves any."""
    for name in ("setattr", "setitem"):
        setattr(pytest.MonkeyPatch, name, _alone(getattr(pytest.MonkeyPatch, name)))


def _alone(replace: Callable[..., None]) -> Callable[..., None]:
    """A method of `pytest.MonkeyPatch` that also switches the results of the session off for its test."""

    def replaced(self: pytest.MonkeyPatch, target: object, *args: object, **more: object) -> None:
        if target is not os.environ and os.environ.get(kept.FOLDER) == FOLDER:
            self.setenv(kept.FOLDER, "off")
        replace(self, target, *args, **more)

    return replaced
