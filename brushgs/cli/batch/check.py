"""Check all jobs before the first one runs: options, scenes and outputs."""

import os
from argparse import Namespace
from collections.abc import Sequence
from contextlib import chdir
from pathlib import Path

from brushgs.cli.batch.jobs import Job
from brushgs.cli.configs import paint_config
from brushgs.cli.parser import command_parser
from brushgs.errors import SceneError
from brushgs.formats.files import exists
from brushgs.options.scene_source import expand


def check_jobs(jobs: Sequence[Job]) -> None:
    """Refuse jobs that cannot be run.

    Raises:
        ValueError: if an option is out of range, a scene is missing, or a job writes a file that another job
            writes or reads; names the job.
    """
    readers: dict[str, Job] = {}
    for job in jobs:
        try:
            with chdir(job.folder):  # where the job will run
                args = command_parser(job.command).parse_args(list(job.words))
                paint_config(args)
                for path in _scenes(args):
                    readers.setdefault(os.path.realpath(path), job)
        except (ValueError, OSError) as error:
            raise ValueError(f"{job.where}: {error}") from None
    writers: dict[str, Job] = {}
    for job in jobs:
        name = os.path.realpath(job.path)
        if name in writers:
            first = writers[name].number
            cure = "give each a name of its own, such as {scene}-{look}-{number}.png"
            raise ValueError(f"{job.where}: writes {job.output}, as job {first} does; {cure}")
        if name in readers:
            cure = "jobs run at the same time: move its reader to a second file, or write another name"
            raise ValueError(
                f"{job.where}: writes {job.output}, which job {readers[name].number} reads; {cure}"
            )
        writers[name] = job


def _scenes(args: Namespace) -> list[Path]:
    """The scene files of a job, relative to the current folder."""
    scenes = getattr(args, "scene", None) or []
    paths = [path for given in (scenes if isinstance(scenes, list) else [scenes]) for path in expand(given)]
    for path in paths:
        if not exists(path):
            raise SceneError(path, "there is no such scene; names are from the folder of the file of jobs")
    return paths
