"""Which jobs of a file are finished: the record of JOBS.toml is .JOBS.toml.json beside it.

A job is finished if it ran with the same options and version, and size and modification time of all its input
and output files are unchanged since.
"""

import os
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from brushgs.cli.batch.jobs import Job
from brushgs.formats.files import add_to_record, begin_record, is_plain, read_record
from brushgs.options.scene_source import SceneSource
from brushgs.version import __version__

_FAULT = "is no record of a batch; remove it, and all jobs run again"
_MAX_BYTES = 256 << 20  # lists all files of up to 10,000 jobs
_State = list[int]  # size and modification time of a file


class JobRecord:
    """The finished jobs of a file of jobs, on disk."""

    def __init__(self, jobs_file: Path, *, is_resumed: bool) -> None:
        """Open the record; its content counts only if the run is resumed.

        Raises:
            SceneError: if the file exists but is not a record.
        """
        self.path = jobs_file.with_name(f".{jobs_file.name}.json")
        self._folder = jobs_file.parent
        self._paintings: dict[str, dict[str, Any]] = {}
        self._is_begun = False
        found = read_record(self.path, "batch", _FAULT, _MAX_BYTES) if is_resumed else None
        self._entries = {str(entry.get("job")): entry for entry in (found or ({}, []))[1]}
        earlier = jobs_file.with_name(f"{jobs_file.stem}.done.json")
        self.note = ""  # note for the report
        if is_resumed and found is None and is_plain(earlier):
            self.note = f"{earlier} is of an earlier version and not read: all jobs run; it can be removed"

    def has(self, job: Job) -> bool:
        """Whether a job is finished. Call it before the job runs: it stores the state of the inputs."""
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
        """State by path, relative to the folder of the jobs; None if the file does not exist."""
        return {os.path.relpath(path, self._folder): _state(path) for path in paths}


def _painting(job: Job) -> dict[str, Any]:
    """Identity of a job: command, options and input files."""
    options: dict[str, list[str]] = {}
    values = options.setdefault("", [])  # positional arguments
    for word in job.words:
        flag, is_one_word, value = word.partition("=")
        if word.startswith("--"):
            values = options.setdefault(flag.removeprefix("--"), [])
            values += [value] if is_one_word else []
        else:
            values.append(word)
    return {"version": __version__, "command": job.command, "options": options, "inputs": _inputs(job)}


def _inputs(job: Job) -> dict[str, _State | None]:
    """Files named by a job's words, and files in named folders, without the output."""
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
