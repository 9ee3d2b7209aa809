"""Which jobs of a file are finished: the record of JOBS.toml is .JOBS.toml.json beside it.

A job is finished if it ran with the same options and version, out of files that have the size and the time of
change that they had then, and every file that it wrote is as it left it.
"""

import os
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from brushgs.cli.batch.jobs import Job
from brushgs.formats.files import is_plain
from brushgs.formats.record import add_to_record, begin_record, read_record
from brushgs.options.scene_source import SceneSource
from brushgs.version import __version__

_FAULT = "is no record of a batch; remove it, and all jobs run again"
_MAX_BYTES = 256 << 20  # it names every file of up to 10,000 jobs
_State = list[int]  # size of a file, and its time of change


class JobRecord:
    """The finished jobs of a file of jobs, on disk."""

    def __init__(self, jobs_file: Path, *, is_resumed: bool) -> None:
        """Open the record; what it says counts only for a run that is resumed.

        Raises:
            SceneError: if it is there, and is something else.
        """
        self.path = jobs_file.with_name(f".{jobs_file.name}.json")
        self._folder = jobs_file.parent
        self._paintings: dict[str, dict[str, Any]] = {}
        self._is_begun = False
        found = read_record(self.path, "batch", _FAULT, _MAX_BYTES) if is_resumed else None
        self._entries = {str(entry.get("job")): entry for entry in (found or ({}, []))[1]}
        earlier = jobs_file.with_name(f"{jobs_file.stem}.done.json")
        self.note = ""  # what is told of it
        if is_resumed and found is None and is_plain(earlier):
            self.note = f"{earlier} is of an earlier version and not read: all jobs run; it can be removed"

    def has(self, job: Job) -> bool:
        """Whether a job is finished; asked before it runs, so that inputs that change later are noticed."""
        painting = self._paintings[job.output] = _painting(job)
        entry = self._entries.get(job.output, {})
        files = entry.get("files")
        if entry.get("painting") != painting or not isinstance(files, dict) or not files:
            return False
        return files == self._states(job.folder / name for name in files)

    def add(self, job: Job, written: Iterable[str]) -> None:
        """Add a job that has just finished, and the files that it wrote.

        Raises:
            SceneError: if the record cannot be written.
        """
        if not self._is_begun:
            begin_record(self.path, {"batch": {"version": __version__}}, self._entries.values())
            self._is_begun = True
        files = self._states(map(Path, written))
        add_to_record(self.path, {"job": job.output, "painting": self._paintings[job.output], "files": files})

    def _states(self, paths: Iterable[Path]) -> dict[str, _State | None]:
        """Files by their names from the folder of the jobs; None of what is none."""
        return {os.path.relpath(path, self._folder): _state(path) for path in paths}


def _painting(job: Job) -> dict[str, Any]:
    """All that decides whether a job is the same: the command, its options, and the files that these name."""
    options: dict[str, list[str]] = {}
    values = options.setdefault("", [])  # of arguments, which stand first
    for word in job.words:
        flag, is_one_word, value = word.partition("=")
        if word.startswith("--"):
            values = options.setdefault(flag.removeprefix("--"), [])
            values += [value] if is_one_word else []
        else:
            values.append(word)
    return {"version": __version__, "command": job.command, "options": options, "inputs": _inputs(job)}


def _inputs(job: Job) -> dict[str, _State | None]:
    """The files that the words of a job name, and those in folders, but for the output."""
    found = set()
    for word in job.words:
        text = re.sub(r"^--[\w-]+=", "", word)
        for name in {text, *re.split(r"[,:\s()]+", text)} - {"", job.output}:
            if "\0" not in name and len(name) < 4096:
                found |= set(SceneSource((job.folder / name,)).files())
    files = sorted(path for path in found if path.is_file() and path != job.path)
    return {os.path.relpath(path, job.folder): _state(path) for path in files}


def _state(path: Path) -> _State | None:
    try:
        stat = path.stat()
    except OSError:
        return None
    return [stat.st_size, stat.st_mtime_ns // 1000] if path.is_file() else None
