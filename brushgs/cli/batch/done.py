"""Which jobs are finished: a small file beside that of the jobs, by which --resume knows what to skip.

A job is finished if it wrote its output with the same words and version, out of files that have the size and
the time of change that they had then, and the output is as the job left it.
"""

import json
import os
import re
from pathlib import Path
from typing import Any

from brushgs.cli.batch.jobs import Job
from brushgs.errors import SceneError
from brushgs.io.files import replacing
from brushgs.io.json_file import read_json
from brushgs.options.scene_source import SceneSource
from brushgs.version import __version__

SCHEMA = 1


class Done:
    """The finished jobs of a file of jobs, on disk."""

    def __init__(self, jobs_file: Path, *, is_resumed: bool) -> None:
        """Open the file; what it says counts only for a run that is resumed.

        Raises:
            SceneError: if it is there, and is not what was written.
        """
        self.path = jobs_file.with_name(f"{jobs_file.stem}.done.json")
        self._jobs: dict[str, Any] = {}
        self._inputs: dict[str, Any] = {}
        if is_resumed and self.path.exists():
            cure = "remove it, and all jobs run again"
            content: Any = read_json(self.path, cure)
            found = content.get("jobs") if isinstance(content, dict) else None
            if (
                not isinstance(content, dict)
                or not isinstance(found, dict)
                or content.get("schema") != SCHEMA
            ):
                raise SceneError(self.path, f"is no list of finished jobs; {cure}")
            self._jobs = found

    def has(self, job: Job) -> bool:
        """Whether a job is finished; asked before it runs, so that inputs that change later are noticed."""
        self._inputs[job.output] = _states_of_inputs(job)
        found = self._jobs.get(job.output)
        return found is not None and _exists(job) and found == self._facts(job)

    def add(self, job: Job) -> None:
        """Remember a job that has just finished.

        Raises:
            SceneError: if the file cannot be written.
        """
        self._jobs[job.output] = self._facts(job)
        with replacing(self.path) as temporary:
            content = {"schema": SCHEMA, "jobs": self._jobs}
            temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")

    def _facts(self, job: Job) -> dict[str, Any]:
        """All that decides whether a job is the same."""
        return {
            "version": __version__,
            "words": [job.command, *job.words],
            "inputs": self._inputs[job.output],
            "output": _state(job.path),
        }


def _exists(job: Job) -> bool:
    """Whether the output is there; of a pattern of numbered files its folder."""
    path = job.path.parent if "%" in job.path.name else job.path
    return path.exists()


def _states_of_inputs(job: Job) -> dict[str, Any]:
    """The files that the words of a job name, and those in folders, but for the output: name -> state."""
    found = set()
    for word in job.words:
        text = re.sub(r"^--[\w-]+=", "", word)
        for name in {text, *re.split(r"[,:\s()]+", text)} - {"", job.output}:
            if "\0" not in name and len(name) < 4096:
                found |= set(SceneSource((job.folder / name,)).files())
    files = sorted(path for path in found if path.is_file() and path != job.path)
    return {os.path.relpath(path, job.folder): _state(path) for path in files}


def _state(path: Path) -> list[float] | None:
    """Size and time of change of a file; None of what is none. Numbers as JSON gives them back."""
    try:
        stat = path.stat()
    except OSError:
        return None
    return [float(stat.st_size), float(stat.st_mtime_ns // 1000)] if path.is_file() else None
